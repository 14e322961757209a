# Read before every chart: size, fonts and what the series look like. `picture` is the file's name.
set terminal pngcairo size 960,600 font "DejaVu Sans,11" enhanced rounded
set output picture
set datafile separator ","
set datafile commentschars "#"
set border 3 linewidth 1 linecolor rgb "#666666"
set tics nomirror textcolor rgb "#333333"
set grid linecolor rgb "#dddddd" linewidth 1 dashtype 1
set key outside right top vertical Left reverse samplen 2 spacing 1.2 noenhanced
set title noenhanced

# One colour a model, the same in every chart. Corrected models are drawn whole, printed ones dashed.
SPRING = "#1b6ca8"
CASCADE = "#c8553d"
FOREST = "#2e8b57"
PLAIN = "#7a6fac"
CASCADE_THESIS = "#e0a458"
FOREST_Z = "#9aa55a"
ROD = "#222222"
BOUND = "#000000" # a boundary that was derived, over what was measured

# The rows of a CSV that fulfil an awk condition on $1, $2 ...: plot rows("stability.csv", "$1 == \"A\"").
rows(file, condition) = "< awk -F, '!/^#/ && (" . condition . ")' " . file
