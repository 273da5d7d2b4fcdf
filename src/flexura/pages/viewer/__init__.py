"""What is drawn, as data for pages, and the page that shows it."""

from flexura.lazy import face

face(__name__)
