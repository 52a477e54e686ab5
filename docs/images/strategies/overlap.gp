# Made by clume bench --study; `gnuplot overlap.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1 5.55078
2 7.28631
4 4.79047
8 4.34174
16 4.07523
32 4.99863
64 4.81543
128 3.53874
EOD
$data1 << EOD
1 81.7695
2 68.9365
4 33.1006
8 31.7285
16 23.1536
32 23.4775
64 22.6719
128 22.3955
EOD
$data2 << EOD
1 8.42305
2 11.5973
4 12.1851
8 15.8379
16 20.8555
32 27.2412
64 38.7744
128 56.3076
EOD
$data3 << EOD
1 27.9508
2 38.957
4 40.8916
8 54.6768
16 85.166
32 164.056
64 320.471
128 800.839
EOD
$data4 << EOD
1 36.8213
2 47.9697
4 45.5498
8 55.8213
16 75.7852
32 111.978
64 155.11
128 271.33
EOD
$data5 << EOD
1 13.397
2 11.2799
4 9.96517
8 10.7643
16 10.8206
32 15.3408
64 17.8887
128 96.4014
EOD
$data6 << EOD
1 8.24902
2 8.44531
4 4.982
8 5.73145
16 4.83602
32 5.29441
64 5.7056
128 8.62891
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
     $data1 using 1:2 with linespoints lc rgb '#0072b2' dt 4 pt 8 lw 2 ps 1 title 'delta:scene', \
     $data2 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'decomposition', \
     $data3 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'regular', \
     $data4 using 1:2 with linespoints lc rgb '#56b4e9' pt 11 lw 2 ps 1 title 'march-analytic', \
     $data5 using 1:2 with linespoints lc rgb '#777777' pt 13 lw 2 ps 1 title 'march', \
     $data6 using 1:2 with linespoints lc rgb '#cc79a7' pt 15 lw 2 ps 1 title 'progressive'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'overlap.png'
replot
unset output
