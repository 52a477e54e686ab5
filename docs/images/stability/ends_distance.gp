# Made by clume stress --report; `gnuplot ends_distance.gp` in this folder makes the plot again.
set encoding utf8
$data0 << EOD
5.62341 0.080239
17.7828 0.310272
56.2341 0.988291
177.828 0.89378
562.341 0.698674
1778.28 0.721747
5623.41 0.842609
17782.8 0.972084
56234.1 0.810539
177828 0.90362
562341 0.740953
1.77828e+06 0.692596
5.62341e+06 0.824492
1.77828e+07 0.614634
EOD
$data1 << EOD
5.62341 0.0535026
17.7828 1.57101
56.2341 12.0336
177.828 42.0347
562.341 90.8774
1778.28 381.715
5623.41 1096.53
17782.8 1151.05
56234.1 1525.46
177828 1661.93
562341 1937.76
1.77828e+06 1849.33
5.62341e+06 1717.69
1.77828e+07 1542.99
EOD
$data2 << EOD
5.62341 0.0413877
17.7828 0.246945
56.2341 0.799142
177.828 0.662101
562.341 0.874999
1778.28 0.578722
5623.41 0.643021
17782.8 0.779624
56234.1 0.956969
177828 0.636531
562341 0.709591
1.77828e+06 0.688154
5.62341e+06 0.733696
1.77828e+07 0.683407
EOD
set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'
set output 'ends_distance.svg'
set title 'Entry and exit: distance to the surface, worst'
set xlabel 'distance of the centre in scales'
set ylabel 'ulp of the scene’s radius'
set logscale x
set logscale y
set format x '%g'
set format y '%g'
set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1
set key outside right center reverse Left samplen 2
set xrange [4.49873:2.22285e+07]
set xtics autofreq
plot $data0 using 1:2 with linespoints lc rgb '#0072b2' pt 7 lw 2 ps 1 title 'clume', \
     $data1 using 1:2 with linespoints lc rgb '#d55e00' pt 5 lw 2 ps 1 title 'c − b²/a', \
     $data2 using 1:2 with linespoints lc rgb '#009e73' pt 9 lw 2 ps 1 title 'quadratic in Σ⁻¹'
set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'
set output 'ends_distance.png'
replot
unset output
