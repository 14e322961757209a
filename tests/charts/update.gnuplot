# The update pass over triangles, beside the thesis's figure 6.1.3: scripts/chart --measure update update.
set title "Update pass: llvmpipe on two cores (processor ms), a GeForce 7800 of 2005"
set xlabel "triangles"
set ylabel "ms"
set logscale xy

plot rows("update.csv", "$1 == \"update\" && $2 == \"update\"") using 3:14 with linespoints lw 2 pt 7 \
         lc rgb SPRING title "pass", \
     rows("update.csv", "$1 == \"update buffer\" && $2 == \"update\"") using 3:14 \
         with linespoints lw 1 pt 5 lc rgb SPRING title "buffer", \
     rows("update.csv", "$1 == \"update cpu\" && $2 == \"update\"") using 3:14 \
         with linespoints lw 1 pt 9 lc rgb SPRING title "cpu", \
     rows("update.csv", "$1 == \"update linear\" && $2 == \"update\"") using 3:14 \
         with linespoints lw 1 dt 2 pt 4 lc rgb SPRING title "linear", \
     rows("thesis-6.1.csv", "$1 == \"6.1.3\"") using 3:6 with linespoints lw 1 dt 3 pt 6 \
         lc rgb CASCADE title "GeForce"
