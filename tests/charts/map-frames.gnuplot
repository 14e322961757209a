# Map I: the frame of a bent link, printed and ours.
load "maps.gp"
set terminal pngcairo size 1180,480
set multiplot layout 1,3 title "The printed frame flips where a bend passes 90 degrees towards its own axis, and shrinks to nothing there;\nours follows parallel transport at every bend" \
    margins 0.06,0.82,0.14,0.8 spacing 0.03
set xrange [0:180]
set yrange [0:90]
set xtics 45
set ytics 15
set xlabel "bend of the joint, degrees"
set ylabel "from the carried axis, degrees"
set title "as printed: twist"
plot sample [t=0:1] "+" using (NaN):(NaN), bins("I", "cascade-thesis") using 3:4:(strcol(5) eq "flip" ? 4 : 0) with image, \
    [t=0:45] "+" using (acos(-tan($1 * pi / 180)**2) * 180 / pi):1 with lines lw 2 lc rgb BOUND, \
    edges("I", "cascade-thesis") using 3:4 with points pt 6 ps 0.8 lc rgb "#333333"
unset ylabel
set format y ""
set title "as printed: length of B"
set palette maxcolors 5 defined (0 CALM, 1 STRETCHED, 2 FLUTTER, 3 LOST, 4 OTHER)
stiff(x, y) = x < 0.1 ? 3 : x < 0.5 ? 2 : x < 0.9 ? 1 : 0
plot sample [t=0:1] "+" using (NaN):(NaN), bins("I", "cascade-thesis/length") using 3:4:(stiff($6, 0)) with image, \
    [t=0:60:0.1] "+" using (asin(sqrt(0.75) / cos($1 * pi / 180)) * 180 / pi):1 with lines lw 2 lc rgb BOUND, \
    [t=0:60:0.1] "+" using (180 - asin(sqrt(0.75) / cos($1 * pi / 180)) * 180 / pi):1 with lines lw 2 lc rgb BOUND
set title "ours: twist"
set key at screen 0.83, screen 0.8 left top
plot sample [t=0:1] "+" using (NaN):(NaN), bins("I", "cascade") using 3:4:(strcol(5) eq "flip" ? 4 : 0) with image, \
    keyentry with boxes fs solid fc rgb CALM title "sound", \
    keyentry with boxes fs solid fc rgb OTHER title "flipped", \
    keyentry with boxes fs solid fc rgb STRETCHED title "shorter than 0.9", \
    keyentry with boxes fs solid fc rgb FLUTTER title "than 0.5", \
    keyentry with boxes fs solid fc rgb LOST title "than 0.1", \
    keyentry with lines lw 2 lc rgb BOUND title "derived", \
    keyentry with points pt 6 ps 0.8 lc rgb "#333333" title "measured"
unset multiplot
