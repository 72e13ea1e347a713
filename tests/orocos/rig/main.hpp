// RTT has a `main` of its own, which begins with what RTT needs, and then calls `ORO_main`. The runtime for Linux needs nothing.

#ifndef RIG_MAIN_HPP
#define RIG_MAIN_HPP

#if __has_include(<rtt/os/main.h>)
#include <rtt/os/main.h>
#else
#define ORO_main main
#endif

#endif
