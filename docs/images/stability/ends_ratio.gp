# Made by clume stress --report; `gnuplot ends_ratio.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1.77828 0.72969
5.62341 0.384497
17.7828 0.34004
56.2341 0.124127
177.828 0.0719816
562.341 0.0291242
1778.28 0.0128956
5623.41 0.0183101
17782.8 0.00969285
56234.1 0.019886
177828 0.0190264
562341 0.0112858
EOD
$data1 << EOD
1.77828 5.34202
5.62341 3.97873
17.7828 1.66972
56.2341 2.07029
177.828 1.48171
562.341 0.14061
1778.28 0.0602661
5623.41 0.0310094
17782.8 0.0088232
56234.1 0.0129242
177828 0.0115846
562341 0.0151796
EOD
$data2 << EOD
1.77828 0.840785
5.62341 0.365608
17.7828 0.290029
56.2341 2.38045
177.828 6.76427
562.341 1.13689
1778.28 5.44922
5623.41 35444.1
17782.8 157778
56234.1 3796.37
177828 145891
562341 7289.27
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'ends_ratio.svg'
set title 'Entry and exit: distance to the surface, worst'
set xlabel 'longest axis over the shortest'
set ylabel 'ulp of the scene’s radius'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [1.42262:702927]
set xtics autofreq
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'clume', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'c − b²/a', \
     $data2 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'quadratic in Σ⁻¹'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'ends_ratio.png'
replot
unset output
