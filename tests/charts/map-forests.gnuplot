# Map C: stiffness and damping of the joints, printed (forward Euler) and corrected.
load "maps.gp"
set terminal pngcairo size 1000,480
set multiplot layout 1,2 title "Forward Euler is calm in a triangle alone, and nowhere without damping;\nthe corrected forest wants no damping and breaks at k dt² = (1 + c) / 2" \
    margins 0.08,0.77,0.14,0.8 spacing 0.09
set xrange [0:1.2]
set xlabel "k dt² / J"
set ylabel "v dt / J, of the joints"
set yrange [0:1.2]
set title "forest-z"
plot sample [t=0:1] "+" using (NaN):(NaN), bins("C", "forest-z") using 3:4:(class(strcol(5))) with image, \
    [t=0:1] "+" using ($1):($1) with lines lw 2 lc rgb BOUND, \
    [t=0:1] "+" using ($1):(0.5 + 0.5 * $1) with lines lw 2 lc rgb BOUND, \
    edges("C", "forest-z") using 3:4 with points pt 6 ps 0.7 lc rgb "#333333"
set title "forest"
set ylabel "1 - c, of all velocity"
set yrange [0:1]
set key at screen 0.78, screen 0.8 left
plot sample [t=0:1] "+" using (NaN):(NaN), bins("C", "forest") using 3:4:(class(strcol(5))) with image, \
    [t=0:1] "+" using (1 - 0.5 * $1):($1) with lines lw 2 lc rgb BOUND title "derived, long strand", \
    edges("C", "forest") using 3:4 with points pt 6 ps 0.7 lc rgb "#333333" title "measured, 7 links", \
    keyentry with boxes fs solid fc rgb CALM title "calm", \
    keyentry with boxes fs solid fc rgb FLUTTER title "flutters", \
    keyentry with boxes fs solid fc rgb LOST title "lost"
unset multiplot
