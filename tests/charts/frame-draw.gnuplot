# Drawing hair over its distance, ours beside the thesis's figure 6.1.10: scripts/chart --measure frame.
set title "Shading pass, 1024 x 768: llvmpipe on two cores (processor ms), a GeForce 7800 of 2005 (4 samples)"
set xlabel "distance, m"
set ylabel "ms"
set logscale xy
set xrange [0.6:8]
set xtics (0.7, 1.4, 7)

ours(triangles, samples) = rows("frame.csv", "$1 == \"draw\" && $2 == \"shade\" && $3 == " . \
                                triangles . " && $7 == " . samples)
thesis(polygons) = rows("thesis-6.1.csv", "$2 == \"draw Kajiya\" && $3 == " . polygons)

plot ours(4000, 1) using 6:14 with linespoints lw 2 pt 7 lc rgb SPRING title "4,000, 1 sample, test", \
     ours(10000, 1) using 6:14 with linespoints lw 2 pt 7 lc rgb CASCADE title "10,000, 1 sample, test", \
     ours(4000, 4) using 6:14 with linespoints lw 2 pt 5 lc rgb SPRING title "4,000, 4 samples, hash", \
     ours(10000, 4) using 6:14 with linespoints lw 2 pt 5 lc rgb CASCADE title "10,000, 4 samples, hash", \
     thesis(4000) using 5:6 with linespoints lw 1 dt 3 pt 6 lc rgb SPRING title "4,000, GeForce", \
     thesis(10000) using 5:6 with linespoints lw 1 dt 3 pt 6 lc rgb CASCADE title "10,000, GeForce"
