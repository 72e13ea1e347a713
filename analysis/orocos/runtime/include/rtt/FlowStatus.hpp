#ifndef MAUVE_RTT_FLOW_STATUS_HPP
#define MAUVE_RTT_FLOW_STATUS_HPP

namespace RTT {

enum FlowStatus { NoData = 0, OldData = 1, NewData = 2 };
enum WriteStatus { WriteSuccess = 0, WriteFailure = 1, NotConnected = 2 };

}  // namespace RTT

#endif
