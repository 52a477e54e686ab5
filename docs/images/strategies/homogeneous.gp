# Made by clume bench --study; `gnuplot homogeneous.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1 7.49706
EOD
$data1 << EOD
1 43.4318
4 20.4457
16 3.36196
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'homogeneous.svg'
set title 'The last segment taken as homogeneous (1000 primitives, one distant light)'
set xlabel 'supports over a point'
set ylabel 'error that does not go away (% of the mean, RMS over pixels)'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center samplen 2
set offsets graph 0.03, graph 0.03, 0, 0
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'optical depth 10', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'optical depth 100'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'homogeneous.png'
replot
unset output
