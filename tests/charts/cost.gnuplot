# What a tick costs, over how many strands: scripts/chart --measure sim cost.
set title "A tick of 8 nodes a strand, 4 substeps, each model as by default, one thread"
set xlabel "strands"
set ylabel "{/Symbol m}s a tick"
set logscale xy
set xrange [7:24000]
set yrange [0.1:30000]

ours(model) = rows("sim.csv", "$1 == \"strands\" && $2 == \"" . model . "\" && $4 == 8")
thesis(model) = rows("thesis-6.1.1.csv", "$1 == \"" . model . "\" && $2 == 8")

plot ours("spring") using 5:13 with linespoints lw 2 pt 7 lc rgb SPRING title "spring", \
     ours("cascade") using 5:13 with linespoints lw 2 pt 7 lc rgb CASCADE title "cascade", \
     ours("forest") using 5:13 with linespoints lw 2 pt 7 lc rgb FOREST title "forest", \
     ours("plain") using 5:13 with linespoints lw 2 pt 7 lc rgb PLAIN title "plain", \
     ours("cascade-thesis") using 5:13 with lines lw 2 dt 2 lc rgb CASCADE_THESIS \
         title "cascade-thesis", \
     ours("forest-z") using 5:13 with lines lw 2 dt 2 lc rgb FOREST_Z title "forest-z", \
     thesis("spring") using 3:4 with linespoints lw 1 dt 3 pt 6 lc rgb SPRING \
         title "spring, Pentium 4", \
     thesis("cascade") using 3:4 with linespoints lw 1 dt 3 pt 6 lc rgb CASCADE \
         title "cascade, Pentium 4", \
     thesis("forest") using 3:4 with linespoints lw 1 dt 3 pt 6 lc rgb FOREST \
         title "forest, Pentium 4", \
     [32:24000] 0.012 * x with lines lw 1 dt 4 lc rgb BOUND title "linear in strands"
