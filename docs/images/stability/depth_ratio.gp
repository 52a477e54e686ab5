# Made by clume stress --report; `gnuplot depth_ratio.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1.77828 0.000688693
5.62341 0.000321465
17.7828 0.000635855
56.2341 0.000324821
177.828 0.000149993
562.341 0.000330752
1778.28 0.00112461
5623.41 0.00211348
17782.8 0.00109851
56234.1 0.00229122
177828 0.00244277
562341 0.0219383
EOD
$data1 << EOD
1.77828 0.0334835
5.62341 0.0490346
17.7828 0.0469523
56.2341 0.0357565
177.828 0.0527116
562.341 0.0317737
1778.28 0.0535061
5623.41 0.129722
17782.8 0.0933983
56234.1 0.140654
177828 0.0895081
562341 0.0708996
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'depth_ratio.svg'
set title 'Optical depth, Gaussian: 90 % of the cases are below'
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
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'erf(b) − erf(a)'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'depth_ratio.png'
replot
unset output
