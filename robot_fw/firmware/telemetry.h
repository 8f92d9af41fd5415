/* The answer to a poll. */

#ifndef TELEMETRY_H
#define TELEMETRY_H

void telemetry_answer(void);

#endif
