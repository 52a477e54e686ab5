# Made by clume stress --report; `gnuplot depth_distance.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
5.62341 1.82308e-05
17.7828 6.47326e-05
56.2341 0.000788392
177.828 0.00136378
562.341 0.0498582
1778.28 0.105763
5623.41 0.218252
17782.8 1
56234.1 1
177828 1
562341 1
1.77828e+06 1.30526
5.62341e+06 2.27047
1.77828e+07 4.3625
EOD
$data1 << EOD
5.62341 0.000377945
17.7828 0.0101279
56.2341 0.0839644
177.828 0.377903
562.341 1
1778.28 1
5623.41 107.198
17782.8 1.68449e+09
177828 1568.27
562341 1.09587e+13
1.77828e+06 3.94753e+25
5.62341e+06 65.6488
1.77828e+07 8.35975e+08
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'depth_distance.svg'
set title 'Optical depth, Gaussian: 90 % of the cases are below'
set xlabel 'distance of the centre in scales'
set ylabel 'relative error'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [4.49873:2.22285e+07]
set xtics autofreq
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'clume', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'erf(b) − erf(a)'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'depth_distance.png'
replot
unset output
