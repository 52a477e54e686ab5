# Made by clume bench --study; `gnuplot density.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
0.1 0.622448
1 1.46387
10 4.9873
100 4.56442
1000 3.28657
EOD
$data1 << EOD
0.1 0.401157
1 3.90492
10 32.6245
100 76.7402
1000 294.893
EOD
$data2 << EOD
0.1 7.1189
1 7.98477
10 17.6084
100 13.3242
1000 7.98418
EOD
$data3 << EOD
0.1 26.7354
1 27.8926
10 65.6699
100 61.0039
1000 42.1768
EOD
$data4 << EOD
0.1 26.6387
1 27.4209
10 61.5361
100 61.8389
1000 39.0479
EOD
$data5 << EOD
0.1 12.7959
1 11.1579
10 11.4763
100 5.15446
1000 2.60063
EOD
$data6 << EOD
0.1 0.308777
1 0.963724
10 6.57185
100 5.44119
1000 4.5832
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
     $data1 using 1:2 with linespoints lc rgb '#0072b2' dt 4 pt 8 lw 2 ps 1 title 'delta:scene', \
     $data2 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'decomposition', \
     $data3 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'regular', \
     $data4 using 1:2 with linespoints lc rgb '#56b4e9' pt 11 lw 2 ps 1 title 'march-analytic', \
     $data5 using 1:2 with linespoints lc rgb '#777777' pt 13 lw 2 ps 1 title 'march', \
     $data6 using 1:2 with linespoints lc rgb '#cc79a7' pt 15 lw 2 ps 1 title 'progressive'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'density.png'
replot
unset output
