"""An allocator of one's own."""

from coordinator.allocate.situation import Situation


class LongestFirst:
    """Gives every free helper the longest strip that is left and that it has not refused."""

    def assign(self, situation: Situation) -> dict[str, int]:
        left = sorted((one.strip for one in situation.strips), key=lambda strip: -strip.length_m)
        offers = {}
        for helper in situation.free:
            strip = next((one for one in left if one.number not in helper.refused), None)
            if strip is not None:
                left.remove(strip)
                offers[helper.vehicle] = strip.number
        return offers
