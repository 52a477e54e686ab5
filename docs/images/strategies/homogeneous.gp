# Made by clume bench --study; `gnuplot homogeneous.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1 5.88872
4 1.15287
16 0.697468
64 0.797169
EOD
$data1 << EOD
1 34.5636
4 16.3707
16 3.87451
64 1.00553
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'homogeneous.svg'
set title 'Last segment taken as homogeneous (1000 primitives, distant light)'
set xlabel 'supports over a point'
set ylabel 'bias of the mean (%)'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [0.8:80]
set xtics (1, 4, 16, 64)
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'optical depth 10', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'optical depth 100'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'homogeneous.png'
replot
unset output
