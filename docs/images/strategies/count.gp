# Made by clume bench --study; `gnuplot count.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
100 1.9181
1000 2.56603
10000 4.57352
100000 10.4263
1e+06 37.1035
EOD
$data1 << EOD
100 3.87539
1000 8.68579
10000 29.7456
100000 88.7754
1e+06 518.64
EOD
$data2 << EOD
100 4.16276
1000 8.99463
10000 15.5676
100000 26.9609
1e+06 66.5234
EOD
$data3 << EOD
100 10.6681
1000 25.4245
10000 54.127
100000 129.459
1e+06 286.314
EOD
$data4 << EOD
100 10.0535
1000 23.9873
10000 53.4551
100000 125.773
1e+06 294.562
EOD
$data5 << EOD
100 5.30257
1000 17.2962
10000 10.9746
100000 28.625
1e+06 80.3018
EOD
$data6 << EOD
100 2.06279
1000 2.71639
10000 5.16962
100000 7.72501
1e+06 13.9092
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
     $data1 using 1:2 with linespoints lc rgb '#0072b2' dt 4 pt 8 lw 2 ps 1 title 'delta:scene', \
     $data2 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'decomposition', \
     $data3 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'regular', \
     $data4 using 1:2 with linespoints lc rgb '#56b4e9' pt 11 lw 2 ps 1 title 'march-analytic', \
     $data5 using 1:2 with linespoints lc rgb '#777777' pt 13 lw 2 ps 1 title 'march', \
     $data6 using 1:2 with linespoints lc rgb '#cc79a7' pt 15 lw 2 ps 1 title 'progressive'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'count.png'
replot
unset output
