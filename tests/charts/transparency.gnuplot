# What each transparency gets wrong against its price: scripts/chart --measure transparency transparency.
set title "Transparency: error against 64 samples a pixel, long hair from 0.5 m"
set xlabel "ms of processor a shading pass, 400 x 300 (llvmpipe)"
set ylabel "mean FLIP"
set logscale x
set xtics (100, 200, 400)
set xrange [80:700]
set yrange [0.009:0.0205]

HASHED = SPRING
BLENDED = CASCADE
TESTED = FOREST
COVERED = PLAIN
shown(condition) = rows("transparency.csv", "$1 == \"close\" && " . condition)
label(samples, sort, pre_z) = sprintf("  %d%s%s", samples, sort eq "auto" ? "" : " " . sort, \
                                      pre_z eq "on" ? " pre-z" : "")

plot for [i = 1:4] shown("$2 == \"" . word("test coverage hash blend", i) . "\"") using 11:8 \
         with points pt 7 ps 1.4 lc rgb word(TESTED . " " . COVERED . " " . HASHED . " " . BLENDED, i) \
         title word("test coverage hash blend", i), \
     shown("$2 != \"x\"") using 11:8:(label($3, strcol(5), strcol(4))) with labels left rotate by 35 offset 0.3,0.5 \
         font ",8" textcolor rgb "#666666" notitle, \
     shown("$12 == 1") using 11:8 with points pt 6 ps 2.4 lw 1.5 lc rgb BOUND title "Pareto front"
