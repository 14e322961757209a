# How far links are from their length in the simulation, before what is published is put right.
set terminal pngcairo size 1200,500 font "DejaVu Sans,11" enhanced rounded
set output picture

links(length, rest) = rows("accuracy.csv", "$1 == \"numerical\" && $2 == \"spring\" && $5 == 15 && $6 == \"shake\" && $28 == \"" . length . "\" && " . rest)
GREENS = "#00441b #238b45 #74c476"
BLUES = "#08306b #2171b5 #4292c6 #74a9cf #a6bddb"

set multiplot
set label 1 "Sweeps stretch as dt², and about as one over their number; from 120 Hz on one direct solve beats sixteen sweeps" \
    at screen 0.5,0.95 center font ",13"
set label 2 "spring, clip shake, damping 15/s; the worst link, as simulated; below 0.001 % float has nothing to correct" \
    at screen 0.5,0.895 center font ",10"
set logscale xy
set yrange [2e-4:20]
set format y "%g"
set tmargin at screen 0.83
set bmargin at screen 0.13

set lmargin at screen 0.065
set rmargin at screen 0.37
set key at screen 0.38,0.83 left top vertical Left reverse samplen 2 spacing 1.1
set ylabel "worst link off its length, %" offset 1,0
set xlabel "sweeps, or direct solves, a substep"
set xrange [0.9:18]
set xtics (1, 2, 4, 8, 16)
plot for [i = 0:4] links("sweeps", "$7 == " . (60 * 2**i)) using 8:15 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb word(BLUES, i + 1) title sprintf("%d Hz", 60 * 2**i), \
     for [i = 0:2] links("direct", "$7 == " . (60 * 2**i)) using 8:15 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb word(GREENS, i + 1) title sprintf("%d Hz, direct", 60 * 2**i)

unset label 1
unset label 2
set lmargin at screen 0.565
set rmargin at screen 0.86
set key at screen 0.87,0.83 left top
set ylabel ""
set xlabel "substeps a second"
set xrange [55:1050]
set xtics (60, 120, 240, 480, 960)
plot for [i = 0:4] links("sweeps", "$8 == " . (2**i)) using 7:15 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb word(BLUES, i + 1) title sprintf("%d sweep%s", 2**i, i > 0 ? "s" : ""), \
     for [i = 0:1] links("direct", "$8 == " . (2**i)) using 7:15 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb word(GREENS, i + 1) title sprintf("%d direct solve%s", 2**i, i > 0 ? "s" : ""), \
     [60:960] 5 * (60 / x)**2 with lines lw 1 dt 3 lc rgb BOUND title "dt²"
unset multiplot
