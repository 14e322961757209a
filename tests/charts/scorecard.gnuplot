# The models by the thesis's five criteria, price and stability, with the figure behind every grade.
# Also writes the same as scorecard.md.
set terminal pngcairo size 1100,430 font "DejaVu Sans,11" enhanced rounded
set output picture
system("awk -F, -v markdown=1 -f scorecard.awk accuracy.csv > scorecard.md")
set datafile separator ";"
CELLS = "< awk -F, -f scorecard.awk accuracy.csv"

set title "Cascade moves most like the rod (4, 5), forest is nearest rest (1), spring is cheapest and bears the stiffest k\n{/*0.85 greener is better; in %: of the strand's length; µs and stretch as shipped (240 Hz, 1 iteration), criteria 3 to 5 against a rod of Γ = 10}" \
    enhanced offset 0,0.3
set key off
unset border
unset grid
unset xtics
set ytics scale 0 textcolor rgb "black"
set yrange [6.5:-0.35]
set xrange [0.5:7.5]
set lmargin 16
set rmargin 2
set tmargin 4
set bmargin 1
unset colorbox
set cbrange [0:1]
set palette defined (0 "#e8a598", 0.5 "#f6e7b4", 1 "#9fd3a8")
set style fill solid 1.0 border lc rgb "white"
plot CELLS using 1:2:(0.49):(0.48):3:ytic(5) with boxxyerror lc palette, \
     CELLS using 1:2:4 with labels font ",13", \
     CELLS using 1:($2 == 1 ? -0.05 : NaN):6 with labels font ",11" noenhanced, \
     CELLS using 1:($2 == 1 ? 0.3 : NaN):7 with labels font ",9" tc rgb "#555555" noenhanced
