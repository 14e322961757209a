# Map D: what a joint answers to a push, printed and corrected.
load "maps.gp"
set terminal pngcairo size 1000,480
set multiplot layout 1,2 title "A straight joint of the printed forest does not feel a push across its plane;\nthe corrected one feels every push alike" \
    margins 0.08,0.88,0.14,0.8 spacing 0.05
set palette maxcolors 256 defined (0 "#8f3e46", 0.1 "#d98476", 0.5 "#f0d483", 1 "#e3ecf1")
set cbrange [0:1]
set xrange [0:180]
set yrange [0:180]
set xtics 45
set ytics 45
set xlabel "rest angle of the joint, degrees"
set ylabel "azimuth of the push, degrees"
# cos² + sin² sin² of the two angles is 0.1: for a rest angle x, sin² of the azimuth is this.
across(x) = 0.9 / (1 - sin(x * pi / 180)**2)
azimuth(x) = across(x) <= 1 ? asin(sqrt(across(x))) * 180 / pi : NaN
set title "forest-z"
set label 1 "less than 0.1" at 20,90 left front
plot sample [t=0:1] "+" using (NaN):(NaN), bins("D", "forest-z") using 3:4:6 with image, \
    [t=0:180:0.1] "+" using ($1):(azimuth($1)) with lines lw 2 lc rgb BOUND, \
    [t=0:180:0.1] "+" using ($1):(180 - azimuth($1)) with lines lw 2 lc rgb BOUND
set title "forest"
unset label 1
unset ylabel
set format y ""
set colorbox user origin screen 0.9,0.14 size 0.02,0.66
set cblabel "response, of what a free link's would be"
plot sample [t=0:1] "+" using (NaN):(NaN), bins("D", "forest") using 3:4:6 with image
unset multiplot
