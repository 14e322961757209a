# Map J: statics beyond a joint's largest moment.
load "maps.gp"
set terminal pngcairo size 1000,480
set multiplot layout 1,2 title "Beyond M = k d² the cascade's joint bends on with less and less to hold it;\nthe forest's keeps its moment" \
    margins 0.08,0.86,0.14,0.8 spacing 0.05
set palette maxcolors 6 defined (0 "#e3ecf1", 1 "#c9dbe3", 2 "#f0d483", 3 "#e0a86c", 4 "#d98476", 5 "#8f3e46")
set cbrange [0:180]
set xrange [0:3]
set yrange [0:180]
set ytics 45
set xtics ("1" 0, "10" 1, "100" 2, "1000" 3)
set xlabel "load, Γ = ρ A g L³ / (E I)"
set ylabel "where the root points, degrees from straight down"
set title "cascade"
set key at graph 0.03, graph 0.2 left top
plot sample [t=0:1] "+" using (NaN):(NaN), bins("J", "cascade") using (log10($3)):4:6 with image, \
    edges("J", "cascade") using (log10($6)):4 with lines lw 2.5 lc rgb BOUND title "derived: M = k d², 90 degrees", \
    edges("J", "cascade") using (log10($3)):4 with points pt 6 ps 0.8 lc rgb "#333333" title "measured"
set title "forest"
unset key
unset ylabel
set format y ""
set colorbox user origin screen 0.88,0.14 size 0.02,0.66
set cbtics 30
set format cb "%g"
set cblabel "largest bend of a joint, degrees" offset 1
plot sample [t=0:1] "+" using (NaN):(NaN), bins("J", "forest") using (log10($3)):4:6 with image
unset multiplot
