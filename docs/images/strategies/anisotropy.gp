# Made by clume bench --study; `gnuplot anisotropy.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1 8.25723
10 12.4699
100 65.96
1000 481.576
EOD
$data1 << EOD
1 69.0234
10 116.76
100 544.302
EOD
$data2 << EOD
1 15.9831
10 30.9355
100 116.117
1000 447.059
EOD
$data3 << EOD
1 70.4238
10 117.848
100 430.313
EOD
$data4 << EOD
1 65.0996
10 174.653
100 765.355
EOD
$data5 << EOD
1 15.3647
10 82.5293
100 1236.43
EOD
$data6 << EOD
1 8.08626
10 7.83691
100 15.2764
1000 71.9883
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'anisotropy.svg'
set title 'Flatter (3·10⁴ discs, overlap 4, optical depth 10)'
set xlabel 'longest over shortest axis'
set ylabel 'processor time per path (µs)'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [0.8:1250]
set xtics (1, 10, 100, 1000)
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'delta:tree', \
     $data1 using 1:2 with linespoints lc rgb '#0072b2' dt 4 pt 8 lw 2 ps 1 title 'delta:scene', \
     $data2 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'decomposition', \
     $data3 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'regular', \
     $data4 using 1:2 with linespoints lc rgb '#56b4e9' pt 11 lw 2 ps 1 title 'march-analytic', \
     $data5 using 1:2 with linespoints lc rgb '#777777' pt 13 lw 2 ps 1 title 'march', \
     $data6 using 1:2 with linespoints lc rgb '#cc79a7' pt 15 lw 2 ps 1 title 'progressive'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'anisotropy.png'
replot
unset output
