# Made by clume bench --study; `gnuplot density.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
0.1 0.601472
1 1.33376
10 4.14101
100 3.06882
1000 3.16607
EOD
$data1 << EOD
0.1 0.565718
1 1.33239
10 4.54932
100 3.06475
1000 3.16551
EOD
$data2 << EOD
0.1 0.409643
1 3.29831
10 31.9219
100 49.4482
1000 284.699
EOD
$data3 << EOD
0.1 5.87988
1 7.69717
10 15.0256
100 10.9134
1000 7.66616
EOD
$data4 << EOD
0.1 24.7839
1 27.0317
10 54.79
100 46.9922
1000 41.1919
EOD
$data5 << EOD
0.1 23.1107
1 26.3959
10 50.4863
100 41.4946
1000 32.582
EOD
$data6 << EOD
0.1 22.8988
1 26.3848
10 50.1143
100 44.0806
1000 37.2676
EOD
$data7 << EOD
0.1 10.8782
1 10.7559
10 10.1794
100 3.56329
1000 2.61499
EOD
$data8 << EOD
0.1 0.35166
1 1.13379
10 5.66309
100 3.78012
1000 4.57045
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'density.svg'
set title 'Denser (10⁴ primitives, overlap 8)'
set xlabel 'optical depth along the diameter'
set ylabel 'processor time per path (µs)'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [0.08:1250]
set xtics (0.1, 1, 10, 100, 1000)
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
set output 'density.png'
replot
unset output
