"""What a flexible function of the motion takes of a joint's residual, whatever its law.

Linear splines over the joint's angle, speed and time, the same of every other joint, products and
signs, what the load and the speed were a while ago, and random cosines of pairs of variables; all
together one group, held small by a ridge that blocks held apart choose.

The functions (`functions`), what they predict of what they were not fitted on (`ridge`), the
products of two and the functions of what the motion was (`pasts`) that are asked one by one, as
every effect is (`products`), a steady tone (`tone`), and what is said of it all (`unknown`).

Source: Rahimi & Recht 2007 (random features); Hoerl & Kennard 1970 (ridge).
"""

from .functions import DIRECTION
from .products import products
from .tone import TONE, steady
from .unknown import HUM, TOLD, Law, Unknown, unknown

__all__ = ["DIRECTION", "HUM", "TOLD", "TONE", "Law", "Unknown", "products", "steady", "unknown"]
