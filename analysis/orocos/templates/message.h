// {mark}: do not change this file.
//
// The message {of}/{name}, with the fields of the header of ROS 1.

#pragma once
@if standard

{standard}
@end
@if own

{own}
@end

namespace {of} {

@if body
struct {name} {
{body}
};
@else
struct {name} {};
@end

}  // namespace {of}
