# What the Adaptive Wisp Tree saves and what that costs: hair-bench tree, beside the paper's ratios.
set terminal pngcairo size 960,1080 font "DejaVu Sans,11" enhanced rounded
set output picture
set multiplot layout 3,1
set logscale x 2
set xrange [56:18000]
set xtics ("64" 64, "256" 256, "512" 512, "1,024" 1024, "2,048" 2048, "4,096" 4096, "16,384" 16384)
set lmargin at screen 0.085
set rmargin at screen 0.66
set key at screen 0.675, screen 0.95 left top Left reverse

CLIPS = "shake nod run turn gust"
COLOURS = "#1b6ca8 #c8553d #2e8b57 #7a6fac #e0a458"
clip(c) = rows("tree.csv", "$1 == \"clips\" && $3 == \"" . c . "\"")
state(s, contact) = rows("tree.csv", \
    "$1 == \"states\" && $5 == \"" . s . "\" && $7 == " . contact)
colour(i) = word(COLOURS, i)

set title "At 64 guides a tick is slower with the tree, from 1,024 on its mean is faster (spring)"
set ylabel "times as fast"
set logscale y
set yrange [0.03:60]
set label 1 "below 1 the tree is slower" at 64,0.06 textcolor rgb "#888888"
plot for [i=1:words(CLIPS)] clip(word(CLIPS, i)) using 4:12 with linespoints pointtype 7 \
         linecolor rgb colour(i) title word(CLIPS, i), \
     state("merged", 0) using 4:12 with lines dashtype 2 linecolor rgb "#222222" \
         title "all merged, by force", \
     state("half", 0) using 4:12 with lines dashtype 3 linecolor rgb "#222222" \
         title "half of each strand split", \
     state("split", 0) using 4:12 with lines dashtype 4 linecolor rgb "#222222" title "all split", \
     state("merged", 1) using 4:12 with lines dashtype 5 linecolor rgb "#aa3333" \
         title "all merged, with contact", \
     7.9 / 0.29 with lines linewidth 2 linecolor rgb "#bbbbbb" \
         title "paper, long hair: 7.9 to 0.29 s", \
     3.1 / 0.32 with lines linewidth 2 dashtype 2 linecolor rgb "#bbbbbb" \
         title "paper, short hair: 3.1 to 0.32 s", \
     1 with lines linecolor rgb "#000000" notitle
unset label 1

set key at screen 0.675, screen 0.62 left top
set title "With positions read out little of that is left; dashed: the worst tick of a clip"
set yrange [0.3:30]
plot for [i=1:words(CLIPS)] clip(word(CLIPS, i)) using 4:(($8+$14)/($10+$14)) with linespoints \
         pointtype 7 linecolor rgb colour(i) title word(CLIPS, i), \
     for [i=1:words(CLIPS)] clip(word(CLIPS, i)) using 4:($9/$11) with linespoints pointtype 6 \
         dashtype 2 linecolor rgb colour(i) title word(CLIPS, i) . ", worst tick", \
     1 with lines linecolor rgb "#000000" notitle

set key at screen 0.675, screen 0.285 left top
set title "RMS error of nodes against those without a tree; dashed: share of nodes split"
set ylabel "% of length; % of nodes"
set xlabel "strands"
set yrange [0.1:110]
plot for [i=1:words(CLIPS)] clip(word(CLIPS, i)) using 4:(100*$17) with linespoints pointtype 7 \
         linecolor rgb colour(i) title word(CLIPS, i), \
     for [i=1:words(CLIPS)] clip(word(CLIPS, i)) using 4:(100*$15) with linespoints pointtype 6 \
         dashtype 2 linecolor rgb colour(i) title word(CLIPS, i) . ", split"
unset multiplot
