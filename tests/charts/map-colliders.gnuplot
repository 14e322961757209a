# Map K: links between nodes that are kept out of a sphere.
load "maps.gp"
set terminal pngcairo size 1280,480
set multiplot layout 1,3 title "Kept out by their nodes, links cut into a sphere with the square of their length;\na pearl hides it up to where the chord comes through, links that collide themselves cut only where long and thin" \
    margins 0.065,0.85,0.14,0.8 spacing 0.06
set xrange [log10(0.05):log10(2)]
set xtics ("0.05" log10(0.05), "0.1" -1, "0.2" log10(0.2), "0.5" log10(0.5), "1" 0, "2" log10(2))
set xlabel "length of a link, radii of the sphere"
set grid linecolor rgb "#dddddd" linewidth 1 dashtype 1
set logscale y
set yrange [1e-4:1]
set ytics ("0.0001" 1e-4, "0.001" 1e-3, "0.01" 1e-2, "0.1" 0.1, "1" 1)
set ylabel "depth of the deepest link, radii"
set title "points: a pearl of no radius"
plot sample [t=log10(0.05):log10(2)] "+" using 1:(1 - sqrt(1 - 0.25 * 10**(2 * $1))) with lines lw 2 lc rgb BOUND, \
    bins("K", "point") using (log10($3)):6 with points pt 6 ps 0.8 lc rgb "#333333"
unset grid
unset logscale y
set yrange [0:0.4]
set ytics 0.1
set ylabel "radius of a pearl, radii of the sphere"
set title "pearls"
set key at screen 0.853, screen 0.8 left top
plot sample [t=0:0.4] "+" using (log10(2 * sqrt((1 + $1)**2 - 0.999**2))):1 with lines lw 2 lc rgb BOUND title "the chord, derived", \
    bins("K", "pearl") using (log10($3)):4:(class(strcol(5))) with image, \
    [t=0:0.4] "+" using (log10(2 * sqrt((1 + $1)**2 - 0.999**2))):1 with lines lw 2 lc rgb BOUND, \
    edges("K", "pearl") using (log10($3)):4 with points pt 6 ps 0.8 lc rgb "#333333" title "measured", \
    keyentry with boxes fs solid fc rgb CALM title "outside", \
    keyentry with boxes fs solid fc rgb OTHER title "cut"
unset key
set ylabel ""
set title "links and pearls (--collide segment)"
plot bins("K", "segment") using (log10($3)):4:(class(strcol(5))) with image
unset multiplot
