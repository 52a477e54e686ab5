# Made by clume bench --study; `gnuplot overlap.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1 5.18717
2 4.97879
4 4.83966
8 6.43183
16 5.34424
32 5.34961
64 5.8099
128 4.95898
EOD
$data1 << EOD
1 5.65055
2 6.58203
4 4.76025
8 6.40658
16 4.85039
32 4.03948
64 5.9873
128 3.62949
EOD
$data2 << EOD
1 79.9385
2 51.4121
4 32.1074
8 38.645
16 23.013
32 19.8115
64 21.9795
128 20.0381
EOD
$data3 << EOD
1 8.43945
2 10.2795
4 12.7937
8 18.3359
16 20.6504
32 28.1832
64 38.2461
128 52.9229
EOD
$data4 << EOD
1 22.9167
2 32.7227
4 41.5098
8 68.9541
16 89.5283
32 166.483
64 316.635
128 785.926
EOD
$data5 << EOD
1 20.5615
2 27.7806
4 39.6331
8 62.8896
16 84.9902
32 157.443
64 325.325
128 802.733
EOD
$data6 << EOD
1 29.292
2 35.4652
4 41.5518
8 63.7441
16 70.9199
32 103.267
64 166.577
128 267.511
EOD
$data7 << EOD
1 10.6521
2 9.33008
4 10.0273
8 13.5744
16 10.9001
32 14.4883
64 20.1997
128 102.221
EOD
$data8 << EOD
1 10.6641
2 5.47461
4 4.57263
8 5.64425
16 5.68327
32 5.15537
64 7.08919
128 6.40639
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'overlap.svg'
set title 'More primitives over a point (10⁴ primitives, optical depth 10)'
set xlabel 'supports over a point'
set ylabel 'processor time per path (µs)'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [0.8:160]
set xtics (1, 2, 4, 8, 16, 32, 64, 128)
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
set output 'overlap.png'
replot
unset output
