# Loaded by the failure maps (map-*.gnuplot): what the classes look like, and the rows of a panel.
CALM = "#e3ecf1"
STRETCHED = "#f0d483"
FLUTTER = "#d98476"
LOST = "#8f3e46"
OTHER = "#9d8fc0" # stiff, flip, fold, cut: the failure that the map is about

set palette maxcolors 5 defined (0 CALM, 1 STRETCHED, 2 FLUTTER, 3 LOST, 4 OTHER)
set cbrange [-0.5:4.5]
unset colorbox
unset grid
set border 15
set tics out
set key opaque noautotitle
class(name) = name eq "calm" ? 0 : name eq "stretched" ? 1 : name eq "flutter" ? 2 : name eq "lost" ? 3 : 4

of(map, panel) = sprintf("$1 == \"%s\" && $2 == \"%s\"", map, panel)
# The bins of a panel, its measured edges with what was derived for them, and its law.
bins(map, panel) = rows("stability.csv", of(map, panel) . " && $5 != \"edge\" && $5 != \"law\"")
edges(map, panel) = rows("stability.csv", of(map, panel) . " && $5 == \"edge\"")
law(map, panel) = rows("stability.csv", of(map, panel) . " && $5 == \"law\"")
