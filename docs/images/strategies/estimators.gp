# Made by clume bench --study; `gnuplot estimators.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
0.1 3.44099e-09
1 8.48074e-08
10 4.8225e-07
100 2.47566e-07
1000 2.08398e-07
EOD
$data1 << EOD
0.1 2.17092e-09
1 5.58188e-08
10 3.49673e-07
100 2.35652e-07
1000 2.83892e-07
EOD
$data2 << EOD
0.1 2.79935e-09
1 4.69143e-08
10 3.70641e-07
100 2.58154e-07
1000 3.04765e-07
EOD
$data3 << EOD
0.1 2.35934e-09
1 5.66651e-08
10 3.97071e-07
100 2.25034e-07
1000 2.48288e-07
EOD
$data4 << EOD
0.1 2.22899e-08
1 2.11318e-07
10 8.22678e-07
100 4.32863e-07
1000 3.3105e-07
EOD
$data5 << EOD
0.1 2.40081e-08
1 2.71516e-07
10 1.11282e-06
100 6.57436e-07
1000 4.64791e-07
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'estimators.svg'
set title 'Shadow rays: one distant light, 10⁴ primitives, overlap 8'
set xlabel 'optical depth along the diameter'
set ylabel 'variance × processor seconds per path'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [0.08:1250]
set xtics (0.1, 1, 10, 100, 1000)
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'delta:tree/analytic', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'delta:tree/ratio', \
     $data2 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'delta:tree/residual-ratio', \
     $data3 using 1:2 with linespoints lc rgb '#cc79a7' pt 13 lw 2 ps 1 title 'delta:tree/binary', \
     $data4 using 1:2 with linespoints lc rgb '#e69f00' pt 11 lw 2 ps 1 title 'decomposition/analytic', \
     $data5 using 1:2 with linespoints lc rgb '#56b4e9' pt 15 lw 2 ps 1 title 'decomposition/binary'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'estimators.png'
replot
unset output
