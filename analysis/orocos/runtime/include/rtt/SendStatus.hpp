#ifndef MAUVE_RTT_SEND_STATUS_HPP
#define MAUVE_RTT_SEND_STATUS_HPP

namespace RTT {

enum SendStatus { CollectFailure = -2, SendFailure = -1, SendNotReady = 0, SendSuccess = 1 };

}  // namespace RTT

#endif
