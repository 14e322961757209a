# Map F: a head that spins, and the step.
load "maps.gp"
set terminal pngcairo size 1100,480
set multiplot layout 1,3 title "Under a head that spins spring stretches with rate times step; forest is calm to its bound of stiffness at any rate,\nand so is cascade, but for 0.11 rad a step and more: there its one direct solve flutters, where sweeps would stretch" \
    margins 0.06,0.79,0.15,0.8 spacing 0.025
set xrange [0:2]
set yrange [0:log10(50)]
set xtics ("1" 0, "3" log10(3), "10" 1, "30" log10(30), "100" 2)
set ytics ("1" 0, "2" log10(2), "4" log10(4), "8" log10(8), "16" log10(16.7), "33" log10(33.3))
set label 1 "rate of the head, rad/s" at screen 0.44,0.03 center
set ylabel "dt, ms"
# 10 % of the first link: (rate dt)² times the sum of (r0 + i d) / d over the nodes beyond it
reach = sqrt(0.1 * 0.04 / (6 * 0.09 + 27 * 0.04))
bound(k) = log10(sqrt(2 * 1.93 / k) * 1e3)
STIFFEST = "1600 192000 48000" # the defaults, times the stiffest modes 1, 16 and 4 of server/models.c
do for [i = 1:3] {
    name = word("spring cascade forest", i)
    set title name
    if (i == 2) { unset label 1; unset ylabel; set format y "" ; set ytics ("" 0, "" log10(2), "" log10(4), "" log10(8), "" log10(16.7), "" log10(33.3)) }
    stiff = bound(real(word(STIFFEST, i)))
    if (i == 3) { set key at screen 0.8, screen 0.8 left }
    if (i == 1) {
        plot sample [t=0:1] "+" using (NaN):(NaN), bins("F", name) using (log10($3)):(log10($4) + 3):(class(strcol(5))) with image, \
            [t=0:2] "+" using ($1):(log10(reach * 1e3) - $1) with lines lw 2 lc rgb BOUND, \
            [t=0:2] "+" using ($1):(stiff) with lines lw 2 dt 2 lc rgb BOUND, \
            edges("F", name) using (log10($3)):(log10($4) + 3) with points pt 6 ps 0.7 lc rgb "#333333"
    }
    if (i == 2) {
        plot sample [t=0:1] "+" using (NaN):(NaN), bins("F", name) using (log10($3)):(log10($4) + 3):(class(strcol(5))) with image, \
            [t=0:2] "+" using ($1):(stiff) with lines lw 2 dt 2 lc rgb BOUND
    }
    if (i == 3) {
        plot sample [t=0:1] "+" using (NaN):(NaN), bins("F", name) using (log10($3)):(log10($4) + 3):(class(strcol(5))) with image, \
            keyentry with lines lw 2 lc rgb BOUND title "10 % of a chain", \
            [t=0:2] "+" using ($1):(stiff) with lines lw 2 dt 2 lc rgb BOUND title "bound of stiffness", \
            keyentry with points pt 6 ps 0.7 lc rgb "#333333" title "10 %, measured", \
            keyentry with boxes fs solid fc rgb CALM title "calm", \
            keyentry with boxes fs solid fc rgb STRETCHED title "stretched", \
            keyentry with boxes fs solid fc rgb FLUTTER title "flutters"
    }
}
unset multiplot
