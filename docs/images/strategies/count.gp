# Made by clume bench --study; `gnuplot count.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
100 1.85272
1000 2.44711
10000 3.97373
100000 9.9334
1e+06 29.5439
EOD
$data1 << EOD
100 1.84498
1000 2.44136
10000 4.48763
100000 9.95664
1e+06 30.4038
EOD
$data2 << EOD
100 3.55811
1000 8.19238
10000 30.9404
100000 86.3574
1e+06 504.458
EOD
$data3 << EOD
100 4.13764
1000 8.89925
10000 15.1611
100000 26.7285
1e+06 56.2422
EOD
$data4 << EOD
100 10.1001
1000 25.2847
10000 55.2178
100000 122.244
1e+06 233.582
EOD
$data5 << EOD
100 8.25181
1000 22.6206
10000 50.9795
100000 116.88
1e+06 226.779
EOD
$data6 << EOD
100 9.74658
1000 23.5684
10000 50.2842
100000 109.784
1e+06 222.163
EOD
$data7 << EOD
100 5.2124
1000 16.8931
10000 10.152
100000 24.403
1e+06 65.1836
EOD
$data8 << EOD
100 1.96641
1000 3.03044
10000 5.8916
100000 5.79287
1e+06 12.305
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'count.svg'
set title 'More and smaller primitives (overlap 8, optical depth 10)'
set xlabel 'primitives'
set ylabel 'processor time per path (µs)'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [80:1.25e+06]
set xtics (100, 1000, 10000, 100000, 1e+06)
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'delta:tree', \
     $data1 using 1:2 with linespoints lc rgb '#0072b2' dt 2 pt 6 lw 2 ps 1 title 'delta:grid', \
     $data2 using 1:2 with linespoints lc rgb '#0072b2' dt 4 pt 8 lw 2 ps 1 title 'delta:scene', \
     $data3 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'decomposition', \
     $data4 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'regular', \
     $data5 using 1:2 with linespoints lc rgb '#e69f00' dt 2 pt 8 lw 2 ps 1 title 'regular-linear', \
     $data6 using 1:2 with linespoints lc rgb '#56b4e9' pt 11 lw 2 ps 1 title 'march-analytic', \
     $data7 using 1:2 with linespoints lc rgb '#777777' pt 13 lw 2 ps 1 title 'march', \
     $data8 using 1:2 with linespoints lc rgb '#cc79a7' pt 15 lw 2 ps 1 title 'progressive'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'count.png'
replot
unset output
