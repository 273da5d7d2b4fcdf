from flexura.testing.virtual.sensor_placement import SensorPlacement as SensorPlacement
from flexura.testing.virtual.sensor_placement import place_sensors as place_sensors
from flexura.testing.virtual.virtual_test import FoundMode as FoundMode
from flexura.testing.virtual.virtual_test import VirtualTest as VirtualTest
from flexura.testing.virtual.virtual_test import virtual_test as virtual_test
