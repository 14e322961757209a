# How far links are from their length in the simulation, before what is published is put right.
set terminal pngcairo size 1100,480 font "DejaVu Sans,11" enhanced rounded
set output picture

links(length, rest) = rows("accuracy.csv", "$1 == \"numerical\" && $2 == \"spring\" && $5 == 15 && $6 == \"shake\" && $28 == \"" . length . "\" && " . rest)

set multiplot layout 1,2 margins 0.07,0.99,0.13,0.84 spacing 0.08,0 \
    title "Sweeps stretch as dt^2 and about as one over their number; from 120 Hz on one direct solve beats sixteen sweeps\n{/*0.85 spring, clip shake, damping 15/s, links as simulated; whole: the worst link, dashed: the mean; green: direct}"
set logscale xy
set yrange [1e-4:20]
set format y "%g"
set ylabel "link off its length, %" offset 1,0
set key opaque inside bottom left vertical Left reverse samplen 2 spacing 1.1

set xlabel "iterations a substep: sweeps, direct solves"
set xrange [0.9:18]
set xtics (1, 2, 4, 8, 16)
GREENS = "#00441b #238b45 #74c476"
BLUES = "#08306b #2171b5 #4292c6 #74a9cf #a6bddb"
plot for [i = 0:4] links("sweeps", "$7 == " . (60 * 2**i)) using 8:15 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb word(BLUES, i + 1) title sprintf("%d Hz", 60 * 2**i), \
     for [i = 0:4] links("sweeps", "$7 == " . (60 * 2**i)) using 8:14 with lines dt 2 lw 1.2 lc rgb word(BLUES, i + 1) notitle, \
     for [i = 0:2] links("direct", "$7 == " . (60 * 2**i)) using 8:15 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb word(GREENS, i + 1) title sprintf("%d Hz, direct", 60 * 2**i)

set xlabel "substeps a second"
set xrange [55:1050]
set xtics (60, 120, 240, 480, 960)
set ylabel ""
plot for [i = 0:4] links("sweeps", "$8 == " . (2**i)) using 7:15 with linespoints pt 7 ps 0.7 lw 1.5 lc rgb word(BLUES, i + 1) title sprintf("%d sweep%s", 2**i, i > 0 ? "s" : ""), \
     for [i = 0:4] links("sweeps", "$8 == " . (2**i)) using 7:14 with lines dt 2 lw 1.2 lc rgb word(BLUES, i + 1) notitle, \
     for [i = 0:1] links("direct", "$8 == " . (2**i)) using 7:15 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb word(GREENS, i + 1) title sprintf("%d direct solve%s", 2**i, i > 0 ? "s" : ""), \
     [60:960] 1.6 * (60 / x)**2 with lines lw 1 dt 3 lc rgb BOUND title "dt^2"
unset multiplot
