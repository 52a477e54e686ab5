# Made by clume bench --study; `gnuplot needles.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
1 7.85645
10 14.5513
100 431.88
EOD
$data1 << EOD
1 6.80492
10 13.4953
100 433.809
EOD
$data2 << EOD
1 63.499
10 155.966
100 3097.24
EOD
$data3 << EOD
1 14.6009
10 60.9844
100 645.828
1000 569.28
EOD
$data4 << EOD
1 55.0396
10 149.477
100 817.979
1000 586.711
EOD
$data5 << EOD
1 53.5264
10 146.972
100 792.007
1000 518.222
EOD
$data6 << EOD
1 57.6768
10 166.479
100 838.824
1000 700.695
EOD
$data7 << EOD
1 14.9873
10 38.8296
100 892.893
EOD
$data8 << EOD
1 7.05737
10 6.2373
100 32.5938
1000 761.305
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'needles.svg'
set title 'Longer (3·10⁴ needles, overlap 4, optical depth 10)'
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
set output 'needles.png'
replot
unset output
