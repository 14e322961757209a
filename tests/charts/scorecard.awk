# The models by the thesis's five criteria (chapter 4, in order of priority), by price and
# stability, from accuracy.csv: awk -F, -f scorecard.awk accuracy.csv
# Percents are of the strand's length; price and stability are of 240 substeps a second, the former
# of 121 strands of 8 nodes. Where a model breaks below that bound: hair-bench stability.
# Lines of column, row, grade (0 bad to 1 good), text; with -v markdown=1 a table.

BEGIN {
    n = split("cascade spring forest plain cascade-thesis forest-z", model, " ")
    variant["cascade"] = "converged"; variant["spring"] = "hang converged"
    variant["forest"] = "outermost converged"; variant["plain"] = "converged"
    variant["cascade-thesis"] = "converged"; variant["forest-z"] = "outermost converged"
    m = split("1 returns to rest|2 keeps length|3 moves freely|4 has inertia|5 outer forces|" \
              "price|stable to", title, "|")
    split("off rest after 1 s, %|worst link, %|reach, rod = 1|off the rod, %|" \
          "off it in wind, %|µs a tick|k/m, 1/s²", unit, "|")
}

/^#/ { next }

# As shipped: 240 substeps a second, an iteration of the model's own length stage (the forests need
# none), damping 8. Stretch is of the gentler clips.
$2 ~ /^(cascade|plain)$/ { own = "direct" }
$2 ~ /^(spring|cascade-thesis)$/ { own = "sweeps" }
$2 ~ /^forest/ { own = "" }
$1 == "numerical" && $5 == 8 && $7 == 240 && $8 <= 1 && $28 == own {
    if ($18 > rest[$2]) rest[$2] = $18
    if ($6 !~ /flip|turn|jump/ && $15 > stretch[$2]) stretch[$2] = $15
    us[$2] = $24
    bound[$2] = $27
}

# Against the stiff rod, damping 15; models converged, so that only the model is judged.
$1 == "rod" && $4 == 10 && $5 == 15 && $2 == "rod" { reach[$6] = $19 }
$1 == "rod" && $4 == 10 && $5 == 15 && $3 == variant[$2] {
    if ($6 == "teleport") astray[$2] = $9 # nothing moves: off the groom
    else if ($6 == "gust") wind[$2] = $12
    else { inertia[$2] += $12; clips[$2]++ }
    if ($6 ~ /^(nod|shake|run)$/) { free[$2] += $19 / reach[$6]; frees[$2]++ }
}

function grade(value, good, bad,   g) {
    g = (log(bad) - log(value > good ? value : good)) / (log(bad) - log(good))
    return g < 0 ? 0 : g
}
function away(ratio,   l) { l = log(ratio); return l < 0 ? -l : l }

# The figure of a cell; its grade in g.
function cell(column, name,   v) {
    if (column == 1) {
        v = rest[name] > astray[name] ? rest[name] : astray[name]
        g = grade(v, 0.01, 0.5)
        return sprintf("%.1f", 100 * v)
    }
    if (column == 2) {
        g = grade(stretch[name], 0.5, 50)
        return sprintf("%.1f", stretch[name])
    }
    if (column == 3) {
        v = free[name] / frees[name]
        g = grade(away(v), 0.05, 0.8)
        return sprintf("%.2f", v)
    }
    if (column == 4) {
        v = inertia[name] / clips[name]
        g = grade(v, 0.03, 0.4)
        return sprintf("%.0f", 100 * v)
    }
    if (column == 5) {
        g = grade(wind[name], 0.01, 0.2)
        return sprintf("%.1f", 100 * wind[name])
    }
    if (column == 6) {
        g = grade(us[name], 3, 30)
        return sprintf("%.1f", us[name])
    }
    v = bound[name]
    g = v > 1e20 ? 1 : grade(1 / v, 1 / 200000, 1 / 5000)
    return v > 1e20 ? "any" : sprintf("%.0f,000", v / 1000)
}

END {
    if (markdown) {
        printf "| |"; for (c = 1; c <= m; ++c) printf " %s: %s |", title[c], unit[c]
        printf "\n|---|"; for (c = 1; c <= m; ++c) printf "---|"
        print ""
    }
    for (r = 1; r <= n; ++r) {
        if (markdown) printf "| %s |", model[r]
        for (c = 1; c <= m; ++c) {
            text = cell(c, model[r])
            if (markdown) printf " %s |", text
            else printf "%d;%d;%.3f;%s;%s;%s;%s\n", c, r, g, text, model[r], title[c], unit[c]
        }
        if (markdown) print ""
    }
}
