# What the tables of marschner err by, over the time that making them takes, and what the light pass
# costs: scripts/chart --measure shading shading.
set terminal pngcairo size 1240,620 font "DejaVu Sans,11" enhanced rounded
set output picture

tables(layout, format) = rows("shading.csv", "$1 == \"blurred\" && $4 == \"" . format . "\" && $5 == \"" . layout . "\"")
# The rows than which no other is both faster and more exact in column `c`.
front(c) = "< awk -F, '$1 == \"blurred\" { print $11 \",\" $" . c . " }' shading.csv | sort -t, -g -k1 | " . \
    "awk -F, 'NR == 1 || $2 < least { least = $2; print }'"
light = "< awk -F, '$1 == \"price\" { print $2 \"|\" $12 }' shading.csv"

set multiplot layout 1,3 margins 0.06,0.965,0.38,0.84 spacing 0.065,0 \
    title "Addressed by angle from end to end, a table of 64 x 64 is exact to a third of a code; sines and cosines miss by tens whatever their format\n{/*0.85 marschner with azimuthal blur; sRGB codes against the fibre in double, over 60,000 random pairs of light and eye; 32, 64, 128, 256 texels; 2 cores, llvmpipe}"
set logscale xy
set xlabel "ms to make the table"
set xrange [5:1000]
set format y "%g"
set key at screen 0.02,0.02 left bottom vertical Left reverse samplen 2 spacing 1.2

set ylabel "99 % of the codes err by less than" offset 1,0
set yrange [0.005:30]
plot front(7) using 1:2 with lines lw 7 lc rgb "#d0d0d0" title "no other is faster and better", \
     tables("ends", "fp16") using 11:7 with linespoints lw 2 pt 7 lc rgb SPRING title "angles, ends, fp16 (default: 64)", \
     tables("ends", "float") using 11:7 with linespoints lw 2 pt 6 lc rgb SPRING dt 2 title "angles, ends, float", \
     tables("ends", "8-bit") using 11:7 with linespoints lw 2 pt 5 lc rgb FOREST title "angles, ends, 8 bits", \
     tables("nalu", "fp16") using 11:7 with linespoints lw 2 pt 7 lc rgb CASCADE title "sines and cosines, centres (Nalu), fp16", \
     tables("nalu", "8-bit") using 11:7 with linespoints lw 2 pt 4 lc rgb CASCADE_THESIS dt 2 title "the same, 8 bits"

unset key
set ylabel "largest error, codes"
set yrange [0.01:300]
plot front(8) using 1:2 with lines lw 7 lc rgb "#d0d0d0", \
     tables("ends", "fp16") using 11:8 with linespoints lw 2 pt 7 lc rgb SPRING, \
     tables("ends", "float") using 11:8 with linespoints lw 2 pt 6 lc rgb SPRING dt 2, \
     tables("ends", "8-bit") using 11:8 with linespoints lw 2 pt 5 lc rgb FOREST, \
     tables("nalu", "fp16") using 11:8 with linespoints lw 2 pt 7 lc rgb CASCADE, \
     tables("nalu", "8-bit") using 11:8 with linespoints lw 2 pt 4 lc rgb CASCADE_THESIS dt 2

unset logscale
set datafile separator "|"
set xlabel ""
set ylabel "ms, light pass of 10,000 points"
set xrange [-0.6:4.6]
set yrange [0:*]
set boxwidth 0.6
set style fill solid 0.8
set xtics rotate by -35 left noenhanced
plot light using 0:2:xtic(1) with boxes lc rgb PLAIN
unset multiplot
