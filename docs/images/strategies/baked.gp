# Made by clume bench --study; `gnuplot baked.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
16 38.4038
32 20.5353
64 9.46572
128 3.09828
256 1.47526
EOD
$data1 << EOD
16 38.0335
32 16.1983
64 4.18349
128 1.05805
256 0.482054
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'baked.svg'
set title 'A mixture''s own grid: error that does not go away'
set xlabel 'voxels along the longest axis'
set ylabel 'RMS over pixels (% of the mean)'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center samplen 2
set offsets graph 0.03, graph 0.03, 0, 0
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'plume', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'smoke_close'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'baked.png'
replot
unset output
