# What accuracy costs: the same model against itself, converged; 60, 120 ... 960 Hz along each line.
set terminal pngcairo size 1200,720 font "DejaVu Sans,10" enhanced rounded
set output picture

front(model, clip, iterations) = rows("accuracy.csv", "$1 == \"numerical\" && $5 == 15 && $2 == \"" . \
    model . "\" && $6 == \"" . clip . "\" && $8 == " . iterations)

set multiplot layout 2,4 margins 0.06,0.99,0.09,0.86 spacing 0.035,0.12 \
    title "Steps buy accuracy, iterations hardly any: error falls with the rate, except where it is chaos\n{/*0.85 five points a line: 60, 120, 240, 480, 960 substeps a second; error against the same model, converged; damping 15/s}"
set logscale xy
set xrange [0.9:130]
set yrange [3e-4:0.6]
set format y "10^{%T}"
set xtics (1, 10, 100)
set key off
do for [clip in "nod shake jump-stop run flip turn gust"] {
    set title clip offset 0,-0.5
    set xlabel (clip eq "turn" || clip eq "flip" || clip eq "gust" ? "µs a tick, 121 strands of 8 nodes" : "") offset 0,0.5
    set ylabel (clip eq "nod" || clip eq "flip" ? "rms error / strand length" : "") offset 1,0
    plot "< awk -F, '$1 == \"numerical\" && $5 == 15 && $2 == \"spring\" && $6 == \"" . clip . "\" && $8 == 1 { f = 3 * ($20 > $21 ? $20 : $21); print 0.9 \",\" f; print 130 \",\" f; exit }' accuracy.csv" \
            using 1:2 with filledcurves y1=1e-9 lc rgb "#eeeeee", \
         front("plain", clip, 1) using 24:9 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb PLAIN, \
         front("forest", clip, 1) using 24:9 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb FOREST, \
         front("cascade", clip, 1) using 24:9 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb CASCADE, \
         front("cascade", clip, 4) using 24:9 with linespoints pt 6 ps 0.7 lw 1.5 dt 2 lc rgb CASCADE, \
         front("spring", clip, 4) using 24:9 with linespoints pt 6 ps 0.7 lw 1.5 dt 2 lc rgb SPRING, \
         front("spring", clip, 16) using 24:9 with linespoints pt 2 ps 0.7 lw 1.5 dt 3 lc rgb SPRING, \
         front("spring", clip, 1) using 24:9 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb SPRING
}
# The eighth place is the legend's.
unset border
unset tics
unset grid
set title ""
set xlabel ""
set ylabel ""
set key center center vertical Left reverse samplen 3 spacing 1.3 font ",10"
plot NaN with linespoints pt 7 lw 1.5 lc rgb SPRING title "spring, 1 iteration", \
     NaN with linespoints pt 6 lw 1.5 dt 2 lc rgb SPRING title "spring, 4 iterations", \
     NaN with linespoints pt 2 lw 1.5 dt 3 lc rgb SPRING title "spring, 16 iterations", \
     NaN with linespoints pt 7 lw 1.5 lc rgb CASCADE title "cascade, 1 iteration", \
     NaN with linespoints pt 6 lw 1.5 dt 2 lc rgb CASCADE title "cascade, 4 iterations", \
     NaN with linespoints pt 7 lw 1.5 lc rgb FOREST title "forest", \
     NaN with linespoints pt 7 lw 1.5 lc rgb PLAIN title "plain, 1 iteration", \
     NaN with filledcurves lc rgb "#e4e4e4" title "floor of spring's truth (chaos)"
unset multiplot
