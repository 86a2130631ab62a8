// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RequestQueue.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <utility>

namespace teravox
{

namespace
{
double Urgency(const LoadRequest& request)
{
  return std::isnan(request.Priority) ? -std::numeric_limits<double>::infinity() : request.Priority;
}

/// The order of the queue's vector: the less urgent first.
bool IsLessUrgent(const LoadRequest& a, const LoadRequest& b)
{
  const double pa = Urgency(a);
  const double pb = Urgency(b);
  return pa != pb ? pa < pb : b.Key < a.Key;
}
} // namespace

void RequestQueue::Replace(std::vector<LoadRequest> wishes)
{
  std::sort(wishes.begin(), wishes.end(),
    [](const LoadRequest& a, const LoadRequest& b) { return IsLessUrgent(b, a); });
  std::unordered_set<BrickKey, BrickKeyHash> seen;
  this->Queued_.clear();
  for (const LoadRequest& wish : wishes)
  {
    if (this->Flights.count(wish.Key) == 0 && seen.insert(wish.Key).second)
    {
      this->Queued_.push_back(wish);
    }
  }
  std::reverse(this->Queued_.begin(), this->Queued_.end());
}

std::optional<RequestQueue::Flight> RequestQueue::Pop()
{
  if (this->Queued_.empty())
  {
    return std::nullopt;
  }
  if (this->Random)
  {
    const std::size_t i = (*this->Random)() % this->Queued_.size();
    std::swap(this->Queued_[i], this->Queued_.back());
  }
  const Flight flight{ this->Queued_.back(), ++this->LastTicket };
  this->Flights[flight.Request.Key] = flight.Ticket;
  this->Queued_.pop_back();
  return flight;
}

bool RequestQueue::IsInFlight(const Flight& flight) const
{
  const auto found = this->Flights.find(flight.Request.Key);
  return found != this->Flights.end() && found->second == flight.Ticket;
}

void RequestQueue::Finish(const Flight& flight)
{
  if (this->IsInFlight(flight))
  {
    this->Flights.erase(flight.Request.Key);
  }
}

void RequestQueue::PutBack(const Flight& flight)
{
  if (!this->IsInFlight(flight))
  {
    return;
  }
  this->Flights.erase(flight.Request.Key);
  // Shuffled queues have no order to keep.
  const auto place = this->Random
    ? this->Queued_.end()
    : std::upper_bound(this->Queued_.begin(), this->Queued_.end(), flight.Request, IsLessUrgent);
  this->Queued_.insert(place, flight.Request);
}

void RequestQueue::RemoveVolume(std::uint32_t volume)
{
  this->Queued_.erase(std::remove_if(this->Queued_.begin(), this->Queued_.end(),
                        [&](const LoadRequest& request) { return request.Key.Volume == volume; }),
    this->Queued_.end());
  for (auto flight = this->Flights.begin(); flight != this->Flights.end();)
  {
    flight = flight->first.Volume == volume ? this->Flights.erase(flight) : std::next(flight);
  }
}

std::vector<LoadRequest> RequestQueue::Wishes() const
{
  return { this->Queued_.rbegin(), this->Queued_.rend() };
}

} // namespace teravox
