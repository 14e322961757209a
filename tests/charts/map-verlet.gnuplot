# Map A: stiffness and damping of every model that takes Verlet's step.
load "maps.gp"
set terminal pngcairo size 1180,480
set multiplot layout 1,4 title "Verlet breaks at 2 (1 + c), as derived, in every corrected model;\nthe printed cascade flutters far below its own bound" \
    margins 0.05,0.8,0.15,0.8 spacing 0.02
set xrange [-2:log10(8)]
set yrange [0:1]
set xtics ("0.01" -2, "0.1" -1, "1" 0, "4" log10(4))
set label 1 "k dt² / m, times the stiffest mode that the model's bound counts with" at screen 0.44,0.03 center
set ylabel "c: velocity kept by a step"
do for [i = 1:4] {
    name = word("spring cascade forest cascade-thesis", i)
    if (i == 2) { unset label 1; unset ylabel; set format y "" }
    if (i == 4) { set key at screen 0.81, screen 0.8 left }
    set title name . ", ×" . word("1 16 4 8", i)
    if (i < 4) {
        plot sample [t=0:1] "+" using (NaN):(NaN), bins("A", name) using (log10($3)):4:(class(strcol(5))) with image, \
            edges("A", name) using (log10($6)):4 with lines lw 2 dt 2 lc rgb BOUND, \
            edges("A", name) using (log10($3)):4 with points pt 6 ps 0.7 lc rgb "#333333", \
            [t=0:1] "+" using (log10(2 * (1 + $1))):($1) with lines lw 2 lc rgb BOUND
    } else {
        plot sample [t=0:1] "+" using (NaN):(NaN), bins("A", name) using (log10($3)):4:(class(strcol(5))) with image, \
            [t=0:1] "+" using (log10(2 * (1 + $1))):($1) with lines lw 2 lc rgb BOUND title "2 (1 + c), long strand", \
            keyentry with lines lw 2 dt 2 lc rgb BOUND title "the same of 7 links", \
            keyentry with points pt 6 ps 0.7 lc rgb "#333333" title "measured, 7 links", \
            keyentry with boxes fs solid fc rgb CALM title "calm", \
            keyentry with boxes fs solid fc rgb FLUTTER title "flutters", \
            keyentry with boxes fs solid fc rgb LOST title "lost"
    }
}
unset multiplot
