// Two nodes without ROS 2: a timer of 20 ms that publishes, and a subscription that executes in a thread of its own. Says of each
// execution its callback and how long it took, measured within its two events.
#define LTTNG_UST_TRACEPOINT_DEFINE
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#include "ros2_events.h"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <thread>

#define EVENT(...) lttng_ust_tracepoint(ros2, __VA_ARGS__)

namespace {

using Clock = std::chrono::steady_clock;

const int executions = 40;
int eye, hand, publisher, timer, subscription, subscription_object;
// A quote, a backslash and a line feed in a name must do no harm.
const char* const symbol = "Eye::look(\"\\\n\")";
int look, grasp;

std::mutex mutex;
std::condition_variable arrived;
int messages = 0;
std::int64_t published[executions];

template <typename Work>
void execute(const void* callback, const char* name, Work work) {
  EVENT(callback_start, callback, 0);
  const auto begin = Clock::now();
  work();
  const auto took = std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - begin).count();
  EVENT(callback_end, callback);
  std::printf("%s %lld\n", name, static_cast<long long>(took));
}

void spin(std::chrono::microseconds time) {
  const auto end = Clock::now() + time;
  while (Clock::now() < end) {
  }
}

void listen() {
  for (int taken = 0; taken < executions; ++taken) {
    {
      std::unique_lock<std::mutex> lock(mutex);
      arrived.wait(lock, [&] { return messages > taken; });
    }
    // The listener takes it 3 ms later, as if a longer callback had its thread.
    spin(std::chrono::microseconds(3000));
    EVENT(rmw_take, nullptr, nullptr, published[taken]);
    execute(&grasp, "hand", [&] { spin(std::chrono::microseconds(1000 + 50 * taken)); });
  }
}

}  // namespace

int main() {
  EVENT(rcl_node_init, &eye, nullptr, "eye", "/arm");
  EVENT(rcl_node_init, &hand, nullptr, "hand", "/");
  EVENT(rcl_publisher_init, &publisher, &eye, "/arm/seen");
  EVENT(rcl_timer_init, &timer, 20000000);
  EVENT(rclcpp_timer_callback_added, &timer, &look);
  EVENT(rclcpp_callback_register, &look, symbol);
  EVENT(rclcpp_timer_link_node, &timer, &eye);
  EVENT(rcl_subscription_init, &subscription, &hand, "/arm/seen");
  EVENT(rclcpp_subscription_init, &subscription, &subscription_object);
  EVENT(rclcpp_subscription_callback_added, &subscription_object, &grasp);
  std::thread listener(listen);
  auto next = Clock::now();
  for (int number = 0; number < executions; ++number) {
    execute(&look, "eye", [&] {
      spin(std::chrono::microseconds(2000));
      EVENT(rcl_publish, &publisher, &number);
      const std::lock_guard<std::mutex> lock(mutex);
      const auto now = std::chrono::system_clock::now().time_since_epoch();
      published[number] = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
      ++messages;
      arrived.notify_one();
    });
    next += std::chrono::milliseconds(20);
    std::this_thread::sleep_until(next);
  }
  listener.join();
  return 0;
}
