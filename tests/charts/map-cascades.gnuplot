# Map B: the printed cascade's downward springs, stiffness, fall-off and gravity; the corrected one
# has a boundary in stiffness alone.
load "maps.gp"
set terminal pngcairo size 1100,700
set multiplot layout 2,3 title "Compensation of gravity takes from the printed cascade all that steadies it;\nthe corrected one is calm to its bound, which gravity raises" \
    margins 0.07,0.79,0.1,0.86 spacing 0.02,0.13
set xrange [-3:0]
set yrange [0:1.5]
set xtics ("0.01" -2, "0.1" -1)
set ytics 0.5
set label 1 "k dt² / m at the root; 7 links, 60 Hz, c = 0.97" at screen 0.44,0.025 center
set label 2 "downward springs' share r" at screen 0.015,0.48 center rotate
do for [i = 1:6] {
    gravity = i < 4 ? "weightless" : "heavy"
    panel = word("uniform linear quadratic", i < 4 ? i : i - 3) . "/" . gravity
    if (i == 2) { unset label }
    set format y (i == 1 || i == 4 ? "%g" : "")
    set title word("uniform linear quadratic", i < 4 ? i : i - 3) . (i < 4 ? " fall-off, compensated" : " fall-off, hanging")
    if (i == 3) { set key at screen 0.8, screen 0.86 left } else { unset key }
    mended = "mended/" . panel
    if (i == 3) {
        plot bins("B", panel) using (log10($3)):4:(class(strcol(5))) with image, \
            edges("B", panel) using (log10($6)):4 with lines lw 2 lc rgb BOUND title "printed, linearised", \
            edges("B", mended) using (log10($6)):(0):(0):(1.5) with vectors nohead lw 2.5 dt 2 lc rgb CASCADE title "corrected, derived", \
            edges("B", mended) using (log10($3)):4 with points pt 7 ps 1.2 lc rgb CASCADE title "corrected, measured", \
            keyentry with boxes fs solid fc rgb CALM title "printed: calm", \
            keyentry with boxes fs solid fc rgb FLUTTER title "printed: flutters"
    } else {
        plot bins("B", panel) using (log10($3)):4:(class(strcol(5))) with image, \
            edges("B", panel) using (log10($6)):4 with lines lw 2 lc rgb BOUND, \
            edges("B", mended) using (log10($6)):(0):(0):(1.5) with vectors nohead lw 2.5 dt 2 lc rgb CASCADE, \
            edges("B", mended) using (log10($3)):4 with points pt 7 ps 1.2 lc rgb CASCADE
    }
}
unset multiplot
