#ifndef RTT_SHIM_CONNECTIONS_HPP
#define RTT_SHIM_CONNECTIONS_HPP

#include <algorithm>
#include <memory>
#include <mutex>
#include <vector>

#include "rtt/internal/Channel.hpp"

namespace RTT {
namespace internal {

// The connections of a port, each with the connections of the port at its other end.
template <class T>
class Connections {
 public:
  struct Connection {
    std::shared_ptr<Channel<T>> channel;
    std::weak_ptr<Connections> other;
  };

  static void connect(const std::shared_ptr<Connections>& one, const std::shared_ptr<Connections>& other,
                      const std::shared_ptr<Channel<T>>& channel) {
    one->add({channel, other});
    other->add({channel, one});
  }

  std::vector<Connection> all() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return all_;
  }

  void disconnect() {
    for (const Connection& connection : all()) {
      if (const std::shared_ptr<Connections> other = connection.other.lock()) other->remove(connection.channel);
      remove(connection.channel);
    }
  }

 private:
  void add(const Connection& connection) {
    const std::lock_guard<std::mutex> lock(mutex_);
    all_.push_back(connection);
  }

  void remove(const std::shared_ptr<Channel<T>>& channel) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto is_it = [&](const Connection& it) { return it.channel == channel; };
    all_.erase(std::remove_if(all_.begin(), all_.end(), is_it), all_.end());
  }

  mutable std::mutex mutex_;
  std::vector<Connection> all_;
};

}  // namespace internal
}  // namespace RTT

#endif
