# How far each model's motion is from that of the rod it stands for, and how late or early its tip is.
set terminal pngcairo size 1200,800 font "DejaVu Sans,11" enhanced rounded
set output picture

# clip, error, lag, in the order of the clips; of the set rod, damping 15/s.
series(gamma, variant) = "< awk -F, -v wanted=\"" . variant . "\" -v gamma=" . gamma . " '" . \
    "$1 == \"rod\" && $4 == gamma && $5 == 15 && $2 \" \" $3 == wanted { e[$6] = $12; l[$6] = $13 }" . \
    "END { n = split(\"nod shake jump-stop run flip turn gust\", c, \" \");" . \
    "for (i = 1; i <= n; ++i) print c[i] \",\" e[c[i]] \",\" (l[c[i]] == \"\" ? \"nan\" : l[c[i]]) }' accuracy.csv"

MODELS = "'cascade converged' 'plain converged' 'spring hang converged' 'spring default converged' " . \
         "'forest outermost converged' 'forest every converged'"
TITLES = "'cascade' 'plain' 'spring, fitted k' 'spring, default k' 'forest' 'forest, head pushes all links'"
COLOURS = CASCADE . " " . PLAIN . " " . SPRING . " #8fbcdc " . FOREST . " #a8d5b5"

set multiplot
set style data histograms
set style histogram clustered gap 1.5
set style fill solid 1.0 noborder
set boxwidth 0.95
set xtics scale 0
set lmargin at screen 0.065
set rmargin at screen 0.79
set label 1 "Only the cascade moves as the rod does: within 3 % of a length, except where the head spins or tips over" \
    at screen 0.43,0.975 center font ",13"
set label 2 "models converged in step and lengths, 7 links against a rod of 42, damping 15/s; {/Symbol G} = {/Symbol r}AgL^3/EI" \
    at screen 0.43,0.943 center font ",10" enhanced

set ylabel "rms error of the motion / length"
set logscale y
set yrange [0.005:1]
set format y "%g"
set tmargin at screen 0.90
set bmargin at screen 0.66
set title "stiff hair, {/Symbol G} = 10" offset 0,-0.7 enhanced
plot for [i = 1:6] series(10, word(MODELS, i)) using 2:xtic(1) title word(TITLES, i) lc rgb word(COLOURS, i)
unset label
set key off
set tmargin at screen 0.59
set bmargin at screen 0.35
set title "soft hair, {/Symbol G} = 50"
plot for [i = 1:6] series(50, word(MODELS, i)) using 2:xtic(1) lc rgb word(COLOURS, i)

set tmargin at screen 0.28
set bmargin at screen 0.05
unset logscale y
set title "tip later than the rod's (negative: earlier), {/Symbol G} = 10"
set ylabel "lag of the tip, ms"
set yrange [-310:150]
set ytics 100
set xzeroaxis linecolor rgb "#666666" linetype 1
plot for [i = 1:6] series(10, word(MODELS, i)) using 3:xtic(1) lc rgb word(COLOURS, i)
unset multiplot
