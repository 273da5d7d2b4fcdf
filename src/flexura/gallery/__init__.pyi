from flexura.gallery.entries import Entry as Entry
from flexura.gallery.entries import entries as entries
from flexura.gallery.entries import entry as entry
