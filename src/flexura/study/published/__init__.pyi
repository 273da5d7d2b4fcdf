from flexura.study.published.published import Published as Published
from flexura.study.published.published import published as published
