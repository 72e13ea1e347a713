#ifndef MAUVE_RTT_CONNECTIONS_HPP
#define MAUVE_RTT_CONNECTIONS_HPP

#include <algorithm>
#include <memory>
#include <vector>

#include "rtt/internal/Channel.hpp"

namespace RTT {
namespace internal {

// The connections of a port, each with the connections of the port at its other end. They change only while no other thread uses
// the ports.
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

  const std::vector<Connection>& all() const { return all_; }

  void disconnect() {
    const std::vector<Connection> connections = all_;
    for (const Connection& connection : connections) {
      if (const std::shared_ptr<Connections> other = connection.other.lock()) other->remove(connection.channel);
      remove(connection.channel);
    }
  }

 private:
  void add(const Connection& connection) { all_.push_back(connection); }

  void remove(const std::shared_ptr<Channel<T>>& channel) {
    const auto is_it = [&](const Connection& it) { return it.channel == channel; };
    all_.erase(std::remove_if(all_.begin(), all_.end(), is_it), all_.end());
  }

  std::vector<Connection> all_;
};

}  // namespace internal
}  // namespace RTT

#endif
