#ifndef MAUVE_RTT_FOSI_H
#define MAUVE_RTT_FOSI_H

#include <sched.h>

#define ORO_SCHED_RT SCHED_FIFO
#define ORO_SCHED_OTHER SCHED_OTHER

#endif
