# Map E: what sweeps of length correction and steps leave of stretch.
load "maps.gp"
set terminal pngcairo size 1100,480
set multiplot layout 1,2 title "Half the step leaves a quarter of the stretch, for which it takes four sweeps in place of one;\none sweep leaves (N - n) g dt² / d, as derived" \
    margins 0.07,0.83,0.14,0.8 spacing 0.1
set logscale y
set yrange [1:50]
set ytics ("1" 1, "2" 2, "4" 4, "8" 8, "16" 16.7, "33" 33.3)
set xrange [-0.5:6.5]
set xtics ("1" 0, "2" 1, "4" 2, "8" 3, "16" 4, "32" 5, "64" 6)
set xlabel "sweeps"
set ylabel "dt, ms"
set title "longest link of 7 that hang (28 cm)"
set key at graph 0.98, graph 0.03 right bottom
bin = exp(log(50) / 52)
plot bins("E", "plain") using (log($3) / log(2)):($4 * 1e3):(log($3) / log(2) - 0.5):(log($3) / log(2) + 0.5):($4 * 1e3 / bin):($4 * 1e3 * bin):(class(strcol(5))) \
        with boxxyerror fs solid noborder lc palette, \
    keyentry with boxes fs solid fc rgb CALM title "within 10 %", \
    keyentry with boxes fs solid fc rgb STRETCHED title "stretched"
set title "the same, by sweeps"
set logscale x
set xrange [1:50]
set xtics ("1" 1, "2" 2, "4" 4, "8" 8, "16" 16.7, "33" 33.3)
set yrange [1e-4:2]
set ytics ("0.01 %%" 1e-4, "0.1 %%" 1e-3, "1 %%" 1e-2, "10 %%" 0.1, "100 %%" 1)
set xlabel "dt, ms"
set ylabel "stretch"
set key at screen 0.84, screen 0.8 left top
near(s) = sprintf("$1 == \"E\" && $3 > %g && $3 < %g", s * 0.9, s * 1.1)
plot [1:50] 6 * 9.81 * (x * 1e-3)**2 / 0.04 with lines lw 2 lc rgb BOUND title "derived, 1 sweep", \
    for [i = 0:6] rows("stability.csv", near(2**i)) using ($4 * 1e3):6 with points pt 7 ps 0.6 \
        lc rgb word("#1b6ca8 #3f83a8 #2e8b57 #9aa55a #e0a458 #c8553d #8f3e46", i + 1) title sprintf(i == 0 ? "%d sweep" : "%d sweeps", 2**i)
unset multiplot
