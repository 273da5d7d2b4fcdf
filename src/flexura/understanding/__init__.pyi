from flexura.understanding.understand import ComparedMode as ComparedMode
from flexura.understanding.understand import RecognisedBlock as RecognisedBlock
from flexura.understanding.understand import RecognisedFlexure as RecognisedFlexure
from flexura.understanding.understand import Understanding as Understanding
from flexura.understanding.understand import understand as understand
