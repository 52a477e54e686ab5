# Made by clume stress --report; `gnuplot flight_ratio.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1.77828 0.00220071
5.62341 0.00233897
17.7828 0.00203027
56.2341 0.0033585
177.828 0.0025643
562.341 0.00462638
1778.28 0.00442181
5623.41 0.0283465
17782.8 0.0408641
56234.1 0.0289971
177828 0.0909284
562341 0.291937
EOD
$data1 << EOD
1.77828 0.00482694
5.62341 0.00933048
17.7828 0.0224076
56.2341 0.0118807
177.828 0.00826301
562.341 0.0307357
1778.28 0.0161892
5623.41 0.0611027
17782.8 0.0627511
56234.1 0.0426855
177828 0.19165
562341 0.318254
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'flight_ratio.svg'
set title 'Free flight, Gaussian, by depth: 90 % of the cases are below'
set xlabel 'longest axis over the shortest'
set ylabel 'relative error'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [1.42262:702927]
set xtics autofreq
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'clume', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'inversion from t = 0'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'flight_ratio.png'
replot
unset output
