# Map G: nodes, against stiffness and stretch.
load "maps.gp"
set terminal pngcairo size 1000,480
set multiplot layout 1,2 title "Eight nodes break within a tenth of a long strand's bound; stretch grows with the square of the nodes" \
    margins 0.08,0.96,0.14,0.84 spacing 0.1
set grid linecolor rgb "#dddddd" linewidth 1 dashtype 1
set border 3
set xlabel "nodes"
set xrange [2:32]
set logscale y
set yrange [0.1:8]
set ylabel "k dt² / m at the edge, c = 0.97"
set title "where strands begin to flutter"
set key at graph 0.98, graph 0.82 right top
set ytics ("0.1" 0.1, "0.2" 0.2, "0.5" 0.5, "1" 1, "2" 2, "4" 4)
plot edges("G", "spring") using 4:6 with lines lw 2 lc rgb BOUND title "eigenvalues of N links", \
    edges("G", "spring") using 4:3 with points pt 7 ps 0.8 lc rgb SPRING title "spring", \
    edges("G", "forest") using 4:6 with lines lw 2 lc rgb BOUND, \
    edges("G", "forest") using 4:3 with points pt 7 ps 0.8 lc rgb FOREST title "forest", \
    edges("G", "cascade") using 4:6 with lines lw 2 lc rgb BOUND, \
    edges("G", "cascade") using 4:3 with points pt 7 ps 0.8 lc rgb CASCADE title "cascade"
set title "longest link of a chain of 28 cm that hangs, 240 Hz"
set ylabel "stretch"
set yrange [1e-4:1]
set ytics ("0.01 %%" 1e-4, "0.1 %%" 1e-3, "1 %%" 1e-2, "10 %%" 0.1, "100 %%" 1)
set key at graph 0.98, graph 0.03 right bottom
of_sweeps(i) = rows("stability.csv", sprintf("$1 == \"G\" && $2 == \"stretch\" && $4 == %d", i))
plot [2.5:32] (x - 2) * (x - 1) * 9.81 / (240.0**2 * 0.28) with lines lw 2 lc rgb BOUND title "derived, 1 sweep", \
    for [i = 1:4] of_sweeps(i) using 3:6 with points pt 7 ps 0.8 \
        lc rgb word("#1b6ca8 #2e8b57 #e0a458 #c8553d", i) title sprintf(i == 1 ? "%d sweep" : "%d sweeps", i)
unset multiplot
