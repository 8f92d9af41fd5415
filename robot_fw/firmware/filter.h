/* The position loop's gains after start-up. How they were found: ../README.md, "Filter". */

#ifndef FILTER_H
#define FILTER_H

#define FILTER_DS       3       /* derivative over 4 samples: a quarter of the noise for the same damping */
#define FILTER_KP       400
#define FILTER_KI       40
#define FILTER_KD       3000
#define FILTER_IL       2000

#endif
