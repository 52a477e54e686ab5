# Made by clume bench --study; `gnuplot discs.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1 7.66392
10 10.312
100 45.5869
1000 396.404
EOD
$data1 << EOD
1 6.76074
10 11.4491
100 46.6411
1000 403.486
EOD
$data2 << EOD
1 74.3057
10 116.17
100 505.104
EOD
$data3 << EOD
1 17.4548
10 29.0361
100 105.863
1000 436.752
EOD
$data4 << EOD
1 67.9751
10 113.806
100 416.382
1000 2562.17
EOD
$data5 << EOD
1 65.833
10 113.094
100 411.37
1000 2703
EOD
$data6 << EOD
1 66.9922
10 155.944
100 662.973
1000 3877.02
EOD
$data7 << EOD
1 15.424
10 71.415
100 1089.58
EOD
$data8 << EOD
1 9.31445
10 6.15826
100 12.6006
1000 66.6201
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'discs.svg'
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
     $data1 using 1:2 with linespoints lc rgb '#0072b2' dt 2 pt 6 lw 2 ps 1 title 'delta:grid', \
     $data2 using 1:2 with linespoints lc rgb '#0072b2' dt 4 pt 8 lw 2 ps 1 title 'delta:scene', \
     $data3 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'decomposition', \
     $data4 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'regular', \
     $data5 using 1:2 with linespoints lc rgb '#e69f00' dt 2 pt 8 lw 2 ps 1 title 'regular-linear', \
     $data6 using 1:2 with linespoints lc rgb '#56b4e9' pt 11 lw 2 ps 1 title 'march-analytic', \
     $data7 using 1:2 with linespoints lc rgb '#777777' pt 13 lw 2 ps 1 title 'march', \
     $data8 using 1:2 with linespoints lc rgb '#cc79a7' pt 15 lw 2 ps 1 title 'progressive'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'discs.png'
replot
unset output
