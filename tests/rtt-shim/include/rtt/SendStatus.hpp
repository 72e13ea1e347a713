#ifndef RTT_SHIM_SEND_STATUS_HPP
#define RTT_SHIM_SEND_STATUS_HPP

namespace RTT {

enum SendStatus { CollectFailure = -2, SendFailure = -1, SendNotReady = 0, SendSuccess = 1 };

}  // namespace RTT

#endif
