# Made by clume stress --report; `gnuplot flight_distance.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
5.62341 8.81526e-06
17.7828 0.00300357
56.2341 0.00872679
177.828 0.0421413
562.341 0.126121
1778.28 0.498648
5623.41 1
17782.8 1
56234.1 1
177828 1
562341 2.8855
1.77828e+06 12.9478
5.62341e+06 21.8456
1.77828e+07 12.6228
EOD
$data1 << EOD
5.62341 6.56022e-05
17.7828 0.00874635
56.2341 0.0246189
177.828 0.471208
562.341 1
1778.28 4.33654
5623.41 3.45765
17782.8 1
56234.1 1
177828 1
562341 1
1.77828e+06 1
5.62341e+06 1
1.77828e+07 1
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'flight_distance.svg'
set title 'Free flight, Gaussian, by depth: 90 % of the cases are below'
set xlabel 'distance of the centre in scales'
set ylabel 'relative error'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [4.49873:2.22285e+07]
set xtics autofreq
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'clume', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'inversion from t = 0'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'flight_distance.png'
replot
unset output
