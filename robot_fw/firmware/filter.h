/* The position loop's gains after start-up. How they were found: ../README.md, "Filter". */

#ifndef FILTER_H
#define FILTER_H

#define FILTER_DS       0       /* derivative interval: every sample */
#define FILTER_KP       60
#define FILTER_KI       20
#define FILTER_KD       400
#define FILTER_IL       4000

#endif
