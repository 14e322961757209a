# Map H: how far from its rest pose a strand comes to rest under a tilted head.
load "maps.gp"
set terminal pngcairo size 900,520
set grid linecolor rgb "#dddddd" linewidth 1 dashtype 1
set border 3
set title "Under a tilted head spring keeps its rest pose; cascade and forest hang, where their own laws put them"
set xlabel "tilt of the head, degrees"
set ylabel "farthest node from its rest place, lengths of the strand"
set xrange [0:180]
set xtics 30
set yrange [-0.03:1.1]
set key inside top left
# As printed, were there no links: the reference is displaced by m g / k fixed to the head, with k at the tip of the
# defaults, 1600 / (16 * 0.28)^2. By its formula; no program of ours does this.
printed(x) = 2 * sin(0.5 * x * pi / 180) * 9.81 / (1600 / (16 * 0.28)**2) / 0.28
plot printed(x) with lines lw 2 dt 3 lc rgb SPRING title "spring as printed (4.4), by its formula", \
    law("H", "cascade") using 3:6 with lines lw 2 lc rgb BOUND title "equilibrium of the law", \
    law("H", "forest") using 3:6 with lines lw 2 lc rgb BOUND, \
    bins("H", "spring") using 3:6 with points pt 7 ps 0.9 lc rgb SPRING title "spring", \
    bins("H", "cascade") using 3:6 with points pt 7 ps 0.9 lc rgb CASCADE title "cascade", \
    bins("H", "forest") using 3:6 with points pt 7 ps 0.9 lc rgb FOREST title "forest"
