#ifndef MAUVE_RTT_CONN_POLICY_HPP
#define MAUVE_RTT_CONN_POLICY_HPP

namespace RTT {

class ConnPolicy {
 public:
  static const int UNSYNC = 0;
  static const int LOCKED = 1;
  static const int LOCK_FREE = 2;

  static const int DATA = 0;
  static const int BUFFER = 1;
  static const int CIRCULAR_BUFFER = 2;

  static ConnPolicy data(int lock_policy = LOCK_FREE, bool init_connection = true, bool pull = false) {
    return make(DATA, 0, lock_policy, init_connection, pull);
  }

  static ConnPolicy buffer(int size, int lock_policy = LOCK_FREE, bool init_connection = false,
                           bool pull = false) {
    return make(BUFFER, size, lock_policy, init_connection, pull);
  }

  static ConnPolicy circularBuffer(int size, int lock_policy = LOCK_FREE,
                                   bool init_connection = false, bool pull = false) {
    return make(CIRCULAR_BUFFER, size, lock_policy, init_connection, pull);
  }

  int type = 0;
  bool init = false;
  int lock_policy = 2;
  bool pull = false;
  int size = 0;

 private:
  static ConnPolicy make(int type, int size, int lock_policy, bool init, bool pull) {
    ConnPolicy policy;
    policy.type = type;
    policy.size = size;
    policy.lock_policy = lock_policy;
    policy.init = init;
    policy.pull = pull;
    return policy;
  }
};

}  // namespace RTT

#endif
