# Made by clume bench --study; `gnuplot baked.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
16 38.4688
32 20.9892
64 9.32312
128 3.56881
256 1.22881
EOD
$data1 << EOD
16 37.7924
32 16.0133
64 4.21318
128 1.09932
256 0.578013
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'baked.svg'
set title 'A mixture''s own grid: error that no number of samples removes'
set xlabel 'voxels along the longest axis'
set ylabel 'RMS over pixels (% of the mean)'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [12.8:320]
set xtics (16, 32, 64, 128, 256)
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'plume', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'smoke_close'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'baked.png'
replot
unset output
