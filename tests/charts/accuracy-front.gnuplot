# What accuracy costs: the same model against itself, converged; 60, 120 ... 960 Hz along each line.
set terminal pngcairo size 1200,720 font "DejaVu Sans,10" enhanced rounded
set output picture

front(model, clip, iterations, length) = rows("accuracy.csv", "$1 == \"numerical\" && $5 == 15 && $2 == \"" . \
    model . "\" && $6 == \"" . clip . "\" && $8 == " . iterations . " && $28 == \"" . length . "\"")

set multiplot layout 2,4 margins 0.06,0.99,0.09,0.86 spacing 0.035,0.12 \
    title "Steps buy accuracy, iterations hardly any: error falls with the rate, except where it is chaos\n{/*0.85 five points a line: 60, 120, 240, 480, 960 substeps a second; error against the same model, converged; defaults of each model, damping 15/s}"
set logscale xy
set xrange [0.7:130]
set yrange [3e-4:1]
set format y "10^{%T}"
set xtics (1, 10, 100)
set key off
do for [clip in "nod shake jump-stop run flip turn gust"] {
    set title clip offset 0,-0.5
    set xlabel (clip eq "turn" || clip eq "flip" || clip eq "gust" ? "µs a tick, 121 strands of 8 nodes" : "") offset 0,0.5
    set ylabel (clip eq "nod" || clip eq "flip" ? "rms error / strand length" : "") offset 1,0
    plot "< awk -F, '$1 == \"numerical\" && $5 == 15 && $2 == \"spring\" && $6 == \"" . clip . "\" && $8 == 1 { f = 3 * ($20 > $21 ? $20 : $21); print 0.7 \",\" f; print 130 \",\" f; exit }' accuracy.csv" \
            using 1:2 with filledcurves y1=1e-9 lc rgb "#eeeeee", \
         front("plain", clip, 1, "direct") using 24:9 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb PLAIN, \
         front("forest", clip, 0, "") using 24:9 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb FOREST, \
         front("cascade", clip, 1, "direct") using 24:9 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb CASCADE, \
         front("spring", clip, 16, "sweeps") using 24:9 with linespoints pt 2 ps 0.7 lw 1.5 dt 3 lc rgb SPRING, \
         front("spring", clip, 1, "direct") using 24:9 with linespoints pt 4 ps 0.8 lw 1.5 dt 2 lc rgb SPRING, \
         front("spring", clip, 1, "sweeps") using 24:9 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb SPRING
}
# The eighth place is the legend's.
unset border
unset tics
unset grid
set title ""
set xlabel ""
set ylabel ""
set key center center vertical Left reverse samplen 3 spacing 1.3 font ",10"
plot NaN with linespoints pt 7 lw 1.5 lc rgb SPRING title "spring, 1 sweep (default)", \
     NaN with linespoints pt 4 lw 1.5 dt 2 lc rgb SPRING title "spring, 1 direct solve", \
     NaN with linespoints pt 2 lw 1.5 dt 3 lc rgb SPRING title "spring, 16 sweeps", \
     NaN with linespoints pt 4 lw 1.5 lc rgb CASCADE title "cascade, 1 direct solve", \
     NaN with linespoints pt 7 lw 1.5 lc rgb FOREST title "forest, no lengths to keep", \
     NaN with linespoints pt 4 lw 1.5 lc rgb PLAIN title "plain, 1 direct solve", \
     NaN with filledcurves lc rgb "#e4e4e4" title "floor of spring's truth (chaos)", \
     NaN with points pt 1 lc rgb "white" title "above 0.1: beyond the bound of k", \
     NaN with points pt 1 lc rgb "white" title "(cascade to 120 Hz, forest at 60)"
unset multiplot
