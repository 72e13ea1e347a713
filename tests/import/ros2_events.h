// The tracepoints of ros2_tracing that a recording of two nodes has, with their fields.
#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER ros2

#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "ros2_events.h"

#if !defined(ROS2_EVENTS_H) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define ROS2_EVENTS_H

#include <lttng/tracepoint.h>

#define FIELDS(...) LTTNG_UST_TP_FIELDS(__VA_ARGS__)
#define POINTER(name) lttng_ust_field_integer_hex(const void*, name, name)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_node_init,
  LTTNG_UST_TP_ARGS(const void*, node_handle, const void*, rmw_handle, const char*, node_name, const char*, ns),
  FIELDS(POINTER(node_handle) POINTER(rmw_handle) lttng_ust_field_string(node_name, node_name)
         lttng_ust_field_string(namespace, ns)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_publisher_init,
  LTTNG_UST_TP_ARGS(const void*, publisher_handle, const void*, node_handle, const char*, topic_name),
  FIELDS(POINTER(publisher_handle) POINTER(node_handle) lttng_ust_field_string(topic_name, topic_name)
         lttng_ust_field_integer(size_t, queue_depth, 10)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_subscription_init,
  LTTNG_UST_TP_ARGS(const void*, subscription_handle, const void*, node_handle, const char*, topic_name),
  FIELDS(POINTER(subscription_handle) POINTER(node_handle) lttng_ust_field_string(topic_name, topic_name)
         lttng_ust_field_integer(size_t, queue_depth, 10)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_subscription_init,
  LTTNG_UST_TP_ARGS(const void*, subscription_handle, const void*, subscription),
  FIELDS(POINTER(subscription_handle) POINTER(subscription)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_subscription_callback_added,
  LTTNG_UST_TP_ARGS(const void*, subscription, const void*, callback),
  FIELDS(POINTER(subscription) POINTER(callback)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_timer_init,
  LTTNG_UST_TP_ARGS(const void*, timer_handle, int64_t, period),
  FIELDS(POINTER(timer_handle) lttng_ust_field_integer(int64_t, period, period)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_timer_callback_added,
  LTTNG_UST_TP_ARGS(const void*, timer_handle, const void*, callback),
  FIELDS(POINTER(timer_handle) POINTER(callback)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_timer_link_node,
  LTTNG_UST_TP_ARGS(const void*, timer_handle, const void*, node_handle),
  FIELDS(POINTER(timer_handle) POINTER(node_handle)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_callback_register,
  LTTNG_UST_TP_ARGS(const void*, callback, const char*, symbol),
  FIELDS(POINTER(callback) lttng_ust_field_string(symbol, symbol)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_publish,
  LTTNG_UST_TP_ARGS(const void*, publisher_handle, const void*, message),
  FIELDS(POINTER(publisher_handle) POINTER(message)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_take,
  LTTNG_UST_TP_ARGS(const void*, rmw_subscription_handle, const void*, message, int64_t, source_timestamp),
  FIELDS(POINTER(rmw_subscription_handle) POINTER(message)
         lttng_ust_field_integer(int64_t, source_timestamp, source_timestamp)
         lttng_ust_field_integer(int, taken, 1)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, callback_start,
  LTTNG_UST_TP_ARGS(const void*, callback, int, is_intra_process),
  FIELDS(POINTER(callback) lttng_ust_field_integer(int, is_intra_process, is_intra_process)))

LTTNG_UST_TRACEPOINT_EVENT(ros2, callback_end,
  LTTNG_UST_TP_ARGS(const void*, callback),
  FIELDS(POINTER(callback)))

#endif

#include <lttng/tracepoint-event.h>
