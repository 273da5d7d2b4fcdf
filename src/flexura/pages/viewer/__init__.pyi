from flexura.pages.viewer.page import bundle as bundle
from flexura.pages.viewer.page import json_text as json_text
from flexura.pages.viewer.page import page as page
