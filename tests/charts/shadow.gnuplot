# Error of shadow methods against what they cost: hair-bench shadow, and the thesis's times.
set terminal pngcairo size 1080,1180 font "DejaVu Sans,11" enhanced rounded
set output picture
set multiplot layout 3,1
set lmargin at screen 0.085
set rmargin at screen 0.70
set logscale x
set logscale y
set key at screen 0.715, screen 0.97 left top Left reverse

NONE = "#999999"
DEPTH = "#1b6ca8"
OPACITY = "#c8553d"
BYTES = "#e0a458"
EXPONENTIAL = "#7a6fac"
DEEP = "#2e8b57"

# Of one scene: a method's rows, and those that no other beats in time and error.
of(set, scene, test) = rows("shadow.csv", "$1 == \"" . set . "\" && $2 == \"" . scene . "\" && " . test)
even(n) = sprintf("$3 == \"opacity\" && $4 == %d && $5 == \"even\" && $7 == \"16F\"", n)
front(set, scene) = "< awk -F, '!/^#/ && $1 == \"" . set . "\" && $2 == \"" . scene . \
    "\" {print $16 \",\" $12}' shadow.csv | sort -t, -g -k1 | awk -F, 'NR == 1 || $2 < best {best = $2; print}'"

do for [scene in "long bob"] {
    set title (scene eq "long" ? \
        "A deep map of 4 surfaces errs as little as 64 and more planes, for the time of 16 (long, 64 to 512 texels)" : \
        "The same on a bob")
    set ylabel "rms error of transmittance"
    set xlabel "processor time of the shadow pass, ms (all threads)"
    set xrange [10:700]
    set yrange [0.05:0.6]
    if (scene eq "bob") {set key at screen 0.715, screen 0.64 left top}
    plot of("groom", scene, "$3 == \"depth\"") using 16:12 with linespoints pointtype 7 \
             linecolor rgb DEPTH title "depth", \
         of("groom", scene, even(4)) using 16:12 with linespoints pointtype 1 linecolor rgb OPACITY \
             title "opacity, 4 planes", \
         of("groom", scene, even(8)) using 16:12 with linespoints pointtype 2 linecolor rgb OPACITY \
             title "8", \
         of("groom", scene, even(16)) using 16:12 with linespoints pointtype 6 linecolor rgb OPACITY \
             title "16", \
         of("groom", scene, even(32)) using 16:12 with linespoints pointtype 7 linecolor rgb OPACITY \
             title "32", \
         of("groom", scene, even(64)) using 16:12 with linespoints pointtype 8 linecolor rgb OPACITY \
             title "64", \
         of("groom", scene, even(128)) using 16:12 with linespoints pointtype 9 linecolor rgb OPACITY \
             title "128", \
         of("groom", scene, "$6 == 1.05 && $4 == 16") using 16:12 with linespoints pointtype 6 \
             linecolor rgb EXPONENTIAL title "layered, 16 planes", \
         of("groom", scene, "$6 == 1.05 && $4 == 32") using 16:12 with linespoints pointtype 7 \
             linecolor rgb EXPONENTIAL title "32", \
         of("groom", scene, "$7 == \"8\"") using 16:12 with linespoints pointtype 6 \
             linecolor rgb BYTES title "opacity, 16, bytes", \
         of("groom", scene, "$3 == \"deep\" && $4 == 3") using 16:12 with linespoints pointtype 6 \
             linecolor rgb DEEP title "deep, 3 surfaces", \
         of("groom", scene, "$3 == \"deep\" && $4 == 4") using 16:12 with linespoints pointtype 7 \
             linecolor rgb DEEP title "4", \
         of("groom", scene, "$3 == \"deep\" && $4 == 8") using 16:12 with linespoints pointtype 9 \
             linecolor rgb DEEP title "8", \
         front("groom", scene) using 1:2 with lines linewidth 5 linecolor rgb "#60cccc44" \
             title "nothing is better and faster"
}

set key at screen 0.715, screen 0.31 left top
set title "Time against texels, 10,000 triangles: ours without a GPU, the thesis's on one of 2005"
set ylabel "shadow pass, ms"
set xlabel "texels across"
set xrange [56:580]
set yrange [0.1:400]
set xtics (64, 128, 256, 512)
ours(test) = rows("shadow.csv", "$1 == \"triangles\" && $11 > 9000 && $11 < 11000 && " . test)
theirs(m) = rows("shadow-7800.csv", "$2 == 10000 && $1 == \"" . m . "\"")
plot ours("$3 == \"depth\"") using 8:16 with linespoints pointtype 7 linecolor rgb DEPTH \
         title "depth, llvmpipe", \
     ours("$3 == \"opacity\" && $4 == 16") using 8:16 with linespoints pointtype 6 \
         linecolor rgb OPACITY title "opacity 16, llvmpipe", \
     ours("$3 == \"deep\" && $4 == 4") using 8:16 with linespoints pointtype 7 linecolor rgb DEEP \
         title "deep 4, llvmpipe", \
     theirs("depth") using 3:4 with linespoints dashtype 2 pointtype 7 linecolor rgb DEPTH \
         title "depth, 7800 GTX", \
     theirs("opacity") using 3:4 with linespoints dashtype 2 pointtype 6 linecolor rgb OPACITY \
         title "opacity 16, 7800 GTX"
unset multiplot
